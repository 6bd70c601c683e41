#include "server/commands/serve_log.h"

#include "server/commands/parameters.h"

namespace lumigraft::server {

std::vector<std::string> ServeLog::lines(const std::vector<std::string>& warnings,
                                         const std::map<std::string, std::uint64_t>& drops, Clock::time_point now) {
  std::vector<std::string> out;
  for (const std::string& warning : warnings) {
    const auto said = said_.find(warning);
    if (said == said_.end() || now - said->second >= kCommands.warning_again) {
      if (said_.size() >= kCommands.max_remembered) said_.clear();
      said_[warning] = now;
      out.push_back("warning: " + warning);
    }
  }
  if (now - drops_time_ < kCommands.drops_every) return out;
  std::string counts;
  for (const auto& [stage, count] : drops) {
    if (const std::uint64_t fresh = count - drops_said_[stage]; fresh > 0) {
      counts += (counts.empty() ? "" : ", ") + stage + " " + std::to_string(fresh);
    }
  }
  if (!counts.empty()) {
    const auto seconds = std::chrono::duration_cast<std::chrono::seconds>(now - drops_time_).count();
    out.push_back("dropped in the last " + std::to_string(seconds) + " s because busy: " + counts);
  }
  drops_said_ = drops;
  drops_time_ = now;
  return out;
}

}  // namespace lumigraft::server
