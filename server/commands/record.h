#pragma once
// `lumigraft record`: records the cameras of a session or configuration as a new session.
#include <atomic>
#include <filesystem>
#include <optional>
#include <ostream>

#include "server/pipeline/service_config.h"

namespace lumigraft::server {

struct RecordCommand {
  ServiceFiles files;
  std::filesystem::path out;
  std::optional<double> seconds;  ///< in each stream's own time
};

/// Ends after `seconds`, at the end of a recording that is copied, or when `interrupted`; then reports what was
/// written. Throws InputError at the start, and std::runtime_error where the disk is full: data written before is kept.
void run_record(const RecordCommand& command, const std::atomic<bool>& interrupted, std::ostream& report);

}  // namespace lumigraft::server
