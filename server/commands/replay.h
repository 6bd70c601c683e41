#pragma once
// `lumigraft replay`: processes a recorded session without dropping, one output picture per colour frame.
//
// All or nothing: files are written into OUT/.lumigraft-partial and moved up after the last frame; they replace the
// pictures of an earlier replay. A replay that fails or is interrupted leaves OUT unchanged. Other files in OUT are
// never touched.
#include <atomic>
#include <filesystem>
#include <limits>

#include "server/pipeline/service_config.h"
#include "server/truth/oracle.h"

namespace lumigraft::server {

struct ReplayCommand {
  ServiceFiles files;
  std::filesystem::path out;
  double from_s = 0.0;  ///< in the recording's time
  int frames = std::numeric_limits<int>::max();
  OracleParts oracle;
  bool dump = false;
};

/// Throws InputError for bad input, std::exception for failures while running. `interrupted` is checked between frames.
/// True when done, false when interrupted.
bool run_replay(const ReplayCommand& command, const std::atomic<bool>& interrupted);

}  // namespace lumigraft::server
