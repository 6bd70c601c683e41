#pragma once
// Notifications to systemd (sd_notify); without effect where it did not start the service.
#include <string>

namespace lumigraft::server {

class ServiceManager {
 public:
  /// Pictures are made: the start has ended.
  void ready();
  /// To be called once a second. `hung`: name of a thread that hangs, empty while none does. While one hangs the
  /// watchdog is not notified, so that systemd restarts the service; the unit's status is the reason.
  void tick(const std::string& hung, const std::string& status);
  void stopping();

 private:
  bool ready_ = false;
  std::string last_;  ///< status
};

}  // namespace lumigraft::server
