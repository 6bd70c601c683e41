#include "capture/live/libcamera/library.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <mutex>
#include <utility>

#include "capture/error.h"

namespace lumigraft::capture::libcam {
namespace {

/// libcamera allows one manager per process. It keeps track of cameras that are plugged in and out.
libcamera::CameraManager& manager() {
  static std::mutex mutex;
  const std::lock_guard lock(mutex);
  static bool started = false;
  if (!started && std::getenv("LIBCAMERA_LOG_LEVELS") == nullptr) {
    libcamera::logSetTarget(libcamera::LoggingTargetNone);  // this program reports errors itself
  }
  static libcamera::CameraManager one;
  if (!started) {
    if (const int error = one.start(); error != 0) {
      throw CameraFault(std::string("libcamera does not start: ") + std::strerror(-error));
    }
    started = true;
  }
  return one;
}

/// libcamera names packed formats as a little-endian word, most significant byte first: its BGR888 is R G B in memory.
const std::array<std::pair<PixelFormat, libcamera::PixelFormat>, 13> kFormats = {
    {{PixelFormat::rgb8, libcamera::formats::BGR888},
     {PixelFormat::bgr8, libcamera::formats::RGB888},
     {PixelFormat::grey8, libcamera::formats::R8},
     {PixelFormat::grey10, libcamera::formats::R10},
     {PixelFormat::grey12, libcamera::formats::R12},
     {PixelFormat::bayer_rggb8, libcamera::formats::SRGGB8},
     {PixelFormat::bayer_bggr8, libcamera::formats::SBGGR8},
     {PixelFormat::bayer_gbrg8, libcamera::formats::SGBRG8},
     {PixelFormat::bayer_grbg8, libcamera::formats::SGRBG8},
     {PixelFormat::yuyv, libcamera::formats::YUYV},
     {PixelFormat::uyvy, libcamera::formats::UYVY},
     {PixelFormat::nv12, libcamera::formats::NV12},
     {PixelFormat::mjpeg, libcamera::formats::MJPEG}}};

libcamera::ControlValue value_of(libcamera::ControlType type, double number) {
  switch (type) {
    case libcamera::ControlTypeBool:
      return number != 0.0;
    case libcamera::ControlTypeByte:
      return static_cast<std::uint8_t>(number);
    case libcamera::ControlTypeInteger32:
      return static_cast<std::int32_t>(std::lround(number));
    case libcamera::ControlTypeInteger64:
      return static_cast<std::int64_t>(std::llround(number));
    default:
      return static_cast<float>(number);
  }
}

/// Whether the camera offers the control. ControlInfoMap::count() is true for every control that libcamera defines.
bool offers(const libcamera::ControlInfoMap& offered, const libcamera::ControlId& control) {
  return offered.find(control.id()) != offered.end();
}

void switch_off(libcamera::ControlList& list, const libcamera::ControlInfoMap& offered,
                const libcamera::Control<bool>& control) {
  if (offers(offered, control)) list.set(control, false);
}

std::optional<double> control_named(const CameraSettings& settings, const std::string& name) {
  const auto found = std::find_if(settings.controls.begin(), settings.controls.end(),
                                  [&](const auto& control) { return control.first == name; });
  return found != settings.controls.end() ? std::optional(found->second) : std::nullopt;
}

[[noreturn]] void refuse_control(const std::string& key) {
  throw InputError(key + ": found no such number among the camera's controls, allowed: what `lumigraft devices` lists");
}

void check_range(const std::string& key, double number, double low, double high) {
  refuse_if(!(number >= low && number <= high), key + ": found " + std::to_string(number) + ", allowed: " +
                                                    std::to_string(low) + " to " + std::to_string(high));
}

/// Sets both gains at once, since libcamera has one control for them.
void set_white_balance(libcamera::ControlList& list, const libcamera::ControlInfoMap& offered,
                       const CameraSettings& settings) {
  const std::optional<double> red = control_named(settings, kRedGain), blue = control_named(settings, kBlueGain);
  if (!red && !blue) return;
  const std::string key = std::string("controls.") + (red ? kRedGain : kBlueGain);
  const auto found = offered.find(libcamera::controls::ColourGains.id());
  if (found == offered.end()) refuse_control(key);
  refuse_if(!red || !blue, key + ": found it alone, allowed: together with " + (red ? kBlueGain : kRedGain));
  const double low = number_in(found->second.min()).value_or(0.0);
  const double high = number_in(found->second.max()).value_or(std::numeric_limits<double>::max());
  for (const auto& [name, gain] : {std::pair(kRedGain, *red), std::pair(kBlueGain, *blue)}) {
    check_range(std::string("controls.") + name, gain, low, high);
  }
  list.set(libcamera::controls::ColourGains, {static_cast<float>(*red), static_cast<float>(*blue)});
}

}  // namespace

std::vector<std::shared_ptr<libcamera::Camera>> cameras() { return manager().cameras(); }

std::shared_ptr<libcamera::Camera> camera_of_node(dev_t node) { return manager().get(node); }

std::string model_of(const libcamera::Camera& camera) {
  return camera.properties().get(libcamera::properties::Model).value_or("");
}

std::optional<PixelFormat> pixel_format_of(const libcamera::PixelFormat& format) {
  const auto* found = std::find_if(kFormats.begin(), kFormats.end(), [&](const auto& f) { return f.second == format; });
  return found != kFormats.end() ? std::optional(found->first) : std::nullopt;
}

std::optional<libcamera::PixelFormat> libcamera_format_of(PixelFormat format) {
  const auto* found = std::find_if(kFormats.begin(), kFormats.end(), [&](const auto& f) { return f.first == format; });
  return found != kFormats.end() ? std::optional(found->second) : std::nullopt;
}

std::optional<double> number_in(const libcamera::ControlValue& value) {
  if (value.isArray()) return std::nullopt;
  switch (value.type()) {
    case libcamera::ControlTypeBool:
      return value.get<bool>() ? 1.0 : 0.0;
    case libcamera::ControlTypeByte:
      return value.get<std::uint8_t>();
    case libcamera::ControlTypeInteger32:
      return value.get<std::int32_t>();
    case libcamera::ControlTypeInteger64:
      return static_cast<double>(value.get<std::int64_t>());
    case libcamera::ControlTypeFloat:
      return static_cast<double>(value.get<float>());
    default:
      return std::nullopt;
  }
}

bool is_array(const libcamera::ControlId& control) {
  namespace known = libcamera::controls;
  const unsigned ids[] = {known::ColourGains.id(), known::ColourCorrectionMatrix.id(), known::FrameDurationLimits.id(),
                          known::SensorBlackLevels.id(), known::AfWindows.id()};
  return std::find(std::begin(ids), std::end(ids), control.id()) != std::end(ids);
}

void set_number(libcamera::ControlList& list, const libcamera::ControlInfoMap& offered, const std::string& name,
                const std::string& key, double number) {
  const auto found = std::find_if(offered.begin(), offered.end(), [&](const auto& c) {
    return c.first->name() == name && !is_array(*c.first) && number_in(c.second.min()) && number_in(c.second.max());
  });
  if (found == offered.end()) refuse_control(key);
  check_range(key, number, *number_in(found->second.min()), *number_in(found->second.max()));
  list.set(found->first->id(), value_of(found->first->type(), number));
}

libcamera::ControlList controls_for(const libcamera::ControlInfoMap& offered, const CameraSettings& settings) {
  libcamera::ControlList list(offered);
  switch_off(list, offered, libcamera::controls::AeEnable);
  switch_off(list, offered, libcamera::controls::AwbEnable);
  if (settings.exposure_us) {
    set_number(list, offered, libcamera::controls::ExposureTime.name(), "exposure_us", *settings.exposure_us);
  }
  if (settings.gain) set_number(list, offered, libcamera::controls::AnalogueGain.name(), "gain", *settings.gain);
  if (settings.rate_hz) {
    refuse_if(!offers(offered, libcamera::controls::FrameDurationLimits),
              "rate_hz: found a camera whose rate is not set this way");
    const auto period_us = static_cast<std::int64_t>(std::llround(1e6 / *settings.rate_hz));
    list.set(libcamera::controls::FrameDurationLimits, {period_us, period_us});
  }
  set_white_balance(list, offered, settings);
  for (const auto& [name, value] : settings.controls) {
    if (name != kRedGain && name != kBlueGain) set_number(list, offered, name, "controls." + name, value);
  }
  return list;
}

ReportedSettings reported_in(const libcamera::ControlList& metadata) {
  ReportedSettings out;
  if (const auto time_us = metadata.get(libcamera::controls::ExposureTime)) out.exposure_us = *time_us;
  if (const auto analogue = metadata.get(libcamera::controls::AnalogueGain)) {
    out.gain = static_cast<double>(*analogue) * metadata.get(libcamera::controls::DigitalGain).value_or(1.0f);
  }
  const auto skew_ns = metadata.get(libcamera::controls::draft::SensorRollingShutterSkew);
  if (skew_ns && *skew_ns >= 0) out.readout_s = 1e-9 * static_cast<double>(*skew_ns);
  return out;
}

}  // namespace lumigraft::capture::libcam
