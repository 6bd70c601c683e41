#pragma once
// `lumigraft import` and `lumigraft export`: other programs' recordings.
//
// TUM is the layout of the RGB-D benchmark of Sturm et al. (2012), "A Benchmark for the Evaluation of RGB-D SLAM
// Systems": rgb.txt and depth.txt list PNG files with their times in seconds; depth counts are 1/5000 m, on the colour
// camera's pixels, 0 where there is none.
#include <atomic>
#include <filesystem>
#include <ostream>
#include <string>
#include <vector>

namespace lumigraft::server {

struct ImportCommand {
  std::filesystem::path from;          ///< a TUM folder, or an .oni file
  std::filesystem::path out;           ///< the session, new or empty
  std::vector<std::string> overrides;  ///< of the session's keys: what the recording does not say, as color.fx
};

/// The session keeps a TUM folder's files as they are; an .oni file is decoded, in a child process first, and recorded.
/// Throws InputError and std::runtime_error.
void run_import(const ImportCommand& command, const std::atomic<bool>& interrupted, std::ostream& report);

struct ExportCommand {
  std::filesystem::path session;
  std::filesystem::path out;  ///< the TUM folder, new or empty
  std::vector<std::string> overrides;
};

/// Colour as 8-bit PNG and depth; the fish-eye too, as fisheye.txt, whose third column is the exposure. Throws as
/// run_import; what was written before an interruption stays.
void run_export(const ExportCommand& command, const std::atomic<bool>& interrupted, std::ostream& report);

}  // namespace lumigraft::server
