#pragma once
// `lumigraft record`: what the cameras of a session or configuration give becomes a session of its own.
#include <atomic>
#include <filesystem>
#include <optional>
#include <ostream>

#include "server/pipeline/service_config.h"

namespace lumigraft::server {

struct RecordCommand {
  ServiceFiles files;
  std::filesystem::path out;
  std::optional<double> seconds;  ///< of every stream's own time
};

/// Ends after `seconds`, with the recording that is copied, or when `interrupted`; then says on `report` what was kept.
/// Throws InputError at the start, and std::runtime_error where the disk takes no more: what came before it is kept.
void run_record(const RecordCommand& command, const std::atomic<bool>& interrupted, std::ostream& report);

}  // namespace lumigraft::server
