#pragma once
// `lumigraft replay`: a recorded session in lock step, one picture per colour frame.
//
// All or nothing: everything is written into OUT/.lumigraft-partial and moved up when the last frame is done, in place
// of the pictures of an earlier replay. A replay that fails or is interrupted leaves OUT as it was. Other files in OUT
// are never touched.
#include <atomic>
#include <filesystem>
#include <limits>

#include "server/pipeline/service_config.h"
#include "server/truth/oracle.h"

namespace lumigraft::server {

struct ReplayCommand {
  ServiceFiles files;
  std::filesystem::path out;
  double from_s = 0.0;  ///< of the recording's own time
  int frames = std::numeric_limits<int>::max();
  OracleParts oracle;
  bool dump = false;
};

/// Throws InputError for bad input, std::exception for what fails while running. `interrupted` is looked at between
/// frames. True when done, false when interrupted.
bool run_replay(const ReplayCommand& command, const std::atomic<bool>& interrupted);

}  // namespace lumigraft::server
