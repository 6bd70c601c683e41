#pragma once
// `lumigraft import` and `lumigraft export`: conversion of other programs' recordings.
//
// TUM is the layout of the RGB-D benchmark of Sturm et al. (2012), "A Benchmark for the Evaluation of RGB-D SLAM
// Systems": rgb.txt and depth.txt list PNG files with their times in seconds; depth values are multiples of 1/5000 m,
// registered to the colour camera's pixels, 0 where not measured.
#include <atomic>
#include <filesystem>
#include <ostream>
#include <string>
#include <vector>

namespace lumigraft::server {

struct ImportCommand {
  std::filesystem::path from;          ///< a TUM folder, or an .oni file
  std::filesystem::path out;           ///< output session folder, new or empty
  std::vector<std::string> overrides;  ///< session keys that the recording lacks, such as color.fx
};

/// Files of a TUM folder are copied unchanged; an .oni file is decoded in a child process and recorded. Throws
/// InputError and std::runtime_error.
void run_import(const ImportCommand& command, const std::atomic<bool>& interrupted, std::ostream& report);

struct ExportCommand {
  std::filesystem::path session;
  std::filesystem::path out;  ///< the TUM folder, new or empty
  std::vector<std::string> overrides;
};

/// Writes colour as 8-bit PNG, depth, and the fish-eye as fisheye.txt, whose third column is the exposure. Throws as
/// run_import; files written before an interruption stay.
void run_export(const ExportCommand& command, const std::atomic<bool>& interrupted, std::ostream& report);

}  // namespace lumigraft::server
