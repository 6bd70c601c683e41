#pragma once
// `lumigraft calibrate`: computes a calibration file from pictures of a printed board, or reports why it cannot.
#include <atomic>
#include <filesystem>
#include <optional>
#include <ostream>

#include "server/pipeline/service_config.h"

namespace lumigraft::server {

struct CalibrateCommand {
  std::filesystem::path board;           ///< TOML, see reconstruct/calibrate/board.h
  std::filesystem::path draw;            ///< board as SVG for printing is written here; empty: not written
  ServiceFiles files;                    ///< session or configuration whose cameras see the board, or
  std::filesystem::path color, fisheye;  ///< folders of pictures; equal file names mean the same time
  std::optional<double> fov_degrees;     ///< of the fish-eye in `fisheye`
  std::optional<double> seconds;         ///< duration for live cameras; empty: until interrupted
  /// ADDRESS:PORT of the guide page; empty: none. Served until interrupted. Live cameras then run until coverage is
  /// complete, or the page's button is pressed, and the result is accepted.
  std::string listen;
  std::filesystem::path sweep;  ///< list of pictures of a static scene with exposures; replaces all inputs above
  /// Output: the calibration file, named by `calibration = "FILE"` of a configuration; for a sweep, the table named by
  /// `response = "FILE"`.
  std::filesystem::path out;
};

/// Writes the results to `report`. Throws InputError where the input is wrong, and std::runtime_error where the
/// calibration is rejected; then no file is written.
void run_calibrate(const CalibrateCommand& command, const std::atomic<bool>& interrupted, std::ostream& report);

}  // namespace lumigraft::server
