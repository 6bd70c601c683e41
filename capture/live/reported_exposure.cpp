#include "capture/live/reported_exposure.h"

#include <cmath>
#include <utility>

#include "capture/live/parameters.h"
#include "capture/message_text.h"
#include "capture/source.h"

namespace lumigraft::capture {
namespace {

double factor_of_db(double gain_db) { return std::pow(10.0, gain_db / 20.0); }

}  // namespace

ReportedExposure::ReportedExposure(const StreamSpec& spec, bool gain_in_db)
    : stream_(spec.stream), session_exposure_(spec.exposure), gain_in_db_(gain_in_db) {
  time_.reference = spec.settings.exposure_us;
  if (spec.settings.gain && gain_in_db) gain_.reference = factor_of_db(*spec.settings.gain);
  if (spec.settings.gain && !gain_in_db && *spec.settings.gain > 0.0) gain_.reference = spec.settings.gain;
}

void ReportedExposure::follow(Factor& factor, double number, const char* name, double reported) {
  constexpr double kMaxRatio = kLiveParameters.max_exposure_ratio;
  const bool positive = std::isfinite(number) && number > 0.0;
  const double ratio = positive ? number / factor.reference.value_or(number) : 0.0;
  if (ratio > 1.0 / kMaxRatio && ratio < kMaxRatio) {
    if (!factor.reference) factor.reference = number;
    factor.ratio = ratio;
  } else if (!std::exchange(factor.warned, true)) {
    warning_ =
        formatted("%s: the camera reports the impossible %s %g; it is ignored", name_of(stream_), name, reported);
  }
}

double ReportedExposure::of_frame(const ReportedSettings& reported) {
  if (const auto us = reported.exposure_us) follow(time_, *us, "exposure time (us)", *us);
  if (const auto gain = reported.gain) follow(gain_, gain_in_db_ ? factor_of_db(*gain) : *gain, "gain", *gain);
  return session_exposure_ * time_.ratio * gain_.ratio;
}

std::string ReportedExposure::take_warning() { return std::exchange(warning_, ""); }

}  // namespace lumigraft::capture
