#pragma once
// The service's log on stderr while it runs: rate-limited, in batches.
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <map>
#include <string>
#include <vector>

namespace lumigraft::server {

class ServeLog {
 public:
  using Clock = std::chrono::steady_clock;
  /// Call about once a second with the newest frame's warnings and the drops since the start, by the slow stage.
  void tick(const std::vector<std::string>& warnings, const std::map<std::string, std::uint64_t>& drops) {
    for (const std::string& line : lines(warnings, drops, Clock::now())) {
      std::fprintf(stderr, "lumigraft: %s\n", line.c_str());
    }
  }

  /// The lines due at `now`.
  std::vector<std::string> lines(const std::vector<std::string>& warnings,
                                 const std::map<std::string, std::uint64_t>& drops, Clock::time_point now);

 private:
  std::map<std::string, Clock::time_point> said_;
  std::map<std::string, std::uint64_t> drops_said_;
  Clock::time_point drops_time_ = Clock::now();
};

}  // namespace lumigraft::server
