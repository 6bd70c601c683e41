#pragma once
// `lumigraft calibrate`: pictures of a printed board become a calibration file, or the reason why they do not.
#include <atomic>
#include <filesystem>
#include <optional>
#include <ostream>

#include "server/pipeline/service_config.h"

namespace lumigraft::server {

struct CalibrateCommand {
  std::filesystem::path board;           ///< TOML, see reconstruct/calibrate/board.h
  std::filesystem::path draw;            ///< SVG to print; empty: none
  ServiceFiles files;                    ///< a session or a configuration whose cameras look at the board, or
  std::filesystem::path color, fisheye;  ///< folders of pictures; those of one name are of one moment
  std::optional<double> fov_degrees;     ///< of the fish-eye in `fisheye`
  std::optional<double> seconds;         ///< of live cameras; until interrupted where empty
  std::string listen;  ///< ADDRESS:PORT of a page that guides; empty: none. It stays until interrupted, and live
                       ///< cameras look until everything is covered, or the page's button is pressed, and what was
                       ///< seen is good enough.
  std::filesystem::path sweep;  ///< a list of pictures of a still scene with their exposures, in place of all that
  std::filesystem::path out;    ///< the calibration, which `calibration = "FILE"` of a configuration names; of
                                ///< a sweep the table that `response = "FILE"` names
};

/// Says on `report` what was found. Throws InputError where the input is wrong, and std::runtime_error where the
/// calibration is refused: nothing is written then.
void run_calibrate(const CalibrateCommand& command, const std::atomic<bool>& interrupted, std::ostream& report);

}  // namespace lumigraft::server
