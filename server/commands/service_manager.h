#pragma once
// What the service tells systemd (sd_notify), if that started it.
#include <string>

namespace lumigraft::server {

class ServiceManager {
 public:
  /// Pictures are made: the start has ended.
  void ready();
  /// To be called once a second. `hung`: what does not answer any more, empty while all do. While something hangs the
  /// watchdog hears nothing, so that it starts the service again, and the reason is the unit's status.
  void tick(const std::string& hung, const std::string& status);
  void stopping();

 private:
  bool ready_ = false;
  std::string last_;  ///< status
};

}  // namespace lumigraft::server
