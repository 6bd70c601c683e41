#pragma once
// Exposure of a frame from the exposure time and gain that its camera reports with it.
//
// The session's `exposure` E holds for its exposure_us t and gain g; a frame that was taken with t' and g' has E t'/t
// g'/g. If the session does not state t or g, it holds for the first that is reported. A number that cannot be true is
// ignored with one warning, and that of the frame before is used: automatic exposure changes slowly.
#include <optional>
#include <string>

#include "capture/session/stream_spec.h"

namespace lumigraft::capture {

/// Settings of one frame; empty where the camera does not report them.
struct ReportedSettings {
  std::optional<double> exposure_us, gain;
  std::optional<double> readout_s = std::nullopt;  ///< Frame::readout_s
};

class ReportedExposure {
 public:
  /// `gain_in_db`: the camera's gain, and the session's, is in decibels of amplitude instead of a factor.
  explicit ReportedExposure(const StreamSpec& spec, bool gain_in_db = false);

  /// Frame::exposure of the next frame.
  double of_frame(const ReportedSettings& reported);
  /// Names the stream and the number that is ignored, once for each of the two; empty if there is none.
  std::string take_warning();

 private:
  struct Factor {
    std::optional<double> reference;
    double ratio = 1.0;  ///< of the last usable number to the reference
    bool warned = false;
  };
  void follow(Factor& factor, double number, const char* name, double reported);

  Stream stream_;
  double session_exposure_;
  bool gain_in_db_;
  Factor time_, gain_;
  std::string warning_;
};

}  // namespace lumigraft::capture
