#include "capture/live/v4l2/controls.h"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>

#include "capture/error.h"
#include "capture/message_text.h"

namespace lumigraft::capture::v4l2 {
namespace {

/// As v4l2-ctl does: letters and digits in lower case, one underscore for any other characters between them.
std::string plain_name(const std::string& driver_name) {
  std::string out;
  bool gap = false;
  for (const char c : driver_name) {
    const bool letter = (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9');
    if (letter) {
      out += gap && !out.empty() ? "_" : "";
      out += static_cast<char>(c >= 'A' && c <= 'Z' ? c + ('a' - 'A') : c);
    }
    gap = !letter;
  }
  return out;
}

bool is_number(const v4l2_query_ext_ctrl& query) {
  switch (query.type) {
    case V4L2_CTRL_TYPE_INTEGER:
    case V4L2_CTRL_TYPE_BOOLEAN:
    case V4L2_CTRL_TYPE_MENU:
    case V4L2_CTRL_TYPE_INTEGER_MENU:
    case V4L2_CTRL_TYPE_INTEGER64:
      return query.nr_of_dims == 0 && (query.flags & (V4L2_CTRL_FLAG_DISABLED | V4L2_CTRL_FLAG_WRITE_ONLY)) == 0;
    default:
      return false;
  }
}

const Control* find(const std::vector<Control>& all, std::uint32_t id) {
  const auto found = std::find_if(all.begin(), all.end(), [id](const Control& c) { return c.id == id; });
  return found != all.end() ? &*found : nullptr;
}

bool is_wide(const Device& device, std::uint32_t id) {
  v4l2_query_ext_ctrl query{};
  query.id = id;
  return device.call(VIDIOC_QUERY_EXT_CTRL, &query) == 0 && query.type == V4L2_CTRL_TYPE_INTEGER64;
}

v4l2_ext_controls request_of(v4l2_ext_control& one) {
  v4l2_ext_controls request{};
  request.which = V4L2_CTRL_WHICH_CUR_VAL;
  request.count = 1;
  request.controls = &one;
  return request;
}

/// 0 or the errno.
int set(const Device& device, std::uint32_t id, std::int64_t value) {
  v4l2_ext_control one{};
  one.id = id;
  if (is_wide(device, id)) {
    one.value64 = value;
  } else {
    one.value = static_cast<__s32>(value);
  }
  v4l2_ext_controls request = request_of(one);
  return device.call(VIDIOC_S_EXT_CTRLS, &request);
}

/// Refuses values that the driver would clip to its range.
void set_within(const Device& device, const Control& control, double value, const std::string& key) {
  const std::int64_t rounded = std::llround(value);
  refuse_if(control.read_only, key + ": found a control that can only be read");
  if (rounded < control.low || rounded > control.high) {
    throw InputError(key + ": found " + std::to_string(rounded) + ", allowed: " + std::to_string(control.low) + " to " +
                     std::to_string(control.high));
  }
  const int error = set(device, control.id, rounded);
  if (error == EINVAL || error == ERANGE || error == EACCES) {  // EACCES: another control disables this one
    throw InputError(key + ": found " + std::to_string(rounded) + ", which the camera does not take now");
  }
  if (error != 0) fail(error, key);
}

/// Sets a control if the camera has it; `what` names it in errors. Only the colour camera may refuse: what it then
/// changes by itself is estimated from its frames.
void fix(const Device& device, const std::vector<Control>& all, capture::Stream stream, std::uint32_t id,
         std::int64_t value, const char* what) {
  const Control* control = find(all, id);
  if (control == nullptr || control->read_only) return;
  const int error = set(device, id, value);
  const bool refused = error == EINVAL || error == ERANGE;
  refuse_if(refused && stream != capture::Stream::color, std::string("found ") + what + " that cannot be switched off");
  if (error != 0 && !refused) fail(error, what);
}

/// The same with a second value, for cameras that do not know the first.
void fix(const Device& device, const std::vector<Control>& all, capture::Stream stream, std::uint32_t id,
         std::int64_t first, std::int64_t second, const char* what) {
  if (find(all, id) != nullptr && set(device, id, first) != 0) fix(device, all, stream, id, second, what);
}

void fix_exposure(const Device& device, const std::vector<Control>& all, capture::Stream stream) {
  fix(device, all, stream, V4L2_CID_EXPOSURE_AUTO, V4L2_EXPOSURE_MANUAL, V4L2_EXPOSURE_SHUTTER_PRIORITY,
      "an automatic exposure");  // with an automatic iris
}

/// Radiance = response / exposure requires a fixed exposure; cameras without these controls have one.
void fix_radiance(const Device& device, const std::vector<Control>& all, capture::Stream stream) {
  fix_exposure(device, all, stream);
  fix(device, all, stream, V4L2_CID_EXPOSURE_AUTO_PRIORITY, 0, "a rate that follows the exposure");
  fix(device, all, stream, V4L2_CID_AUTOGAIN, 0, "an automatic gain");
  fix(device, all, stream, V4L2_CID_AUTOBRIGHTNESS, 0, "an automatic brightness");
  fix(device, all, stream, V4L2_CID_AUTO_WHITE_BALANCE, 0, "an automatic white balance");
  fix(device, all, stream, V4L2_CID_HUE_AUTO, 0, "an automatic hue");
  // Against flicker. Most of the world has 50 Hz (IEC TR 60083); `controls` may say otherwise.
  fix(device, all, capture::Stream::color, V4L2_CID_POWER_LINE_FREQUENCY, V4L2_CID_POWER_LINE_FREQUENCY_AUTO,
      V4L2_CID_POWER_LINE_FREQUENCY_50HZ, "mains flicker");
}

constexpr std::uint32_t kAutomatic[] = {V4L2_CID_EXPOSURE_AUTO, V4L2_CID_AUTOGAIN, V4L2_CID_AUTO_WHITE_BALANCE};
constexpr std::uint32_t kAdapted[] = {V4L2_CID_EXPOSURE_ABSOLUTE,
                                      V4L2_CID_EXPOSURE,
                                      V4L2_CID_GAIN,
                                      V4L2_CID_ANALOGUE_GAIN,
                                      V4L2_CID_RED_BALANCE,
                                      V4L2_CID_BLUE_BALANCE,
                                      V4L2_CID_WHITE_BALANCE_TEMPERATURE};

std::vector<Control> adapted_controls(const Device& device) {
  std::vector<Control> out = controls(device);
  std::erase_if(
      out, [](const Control& c) { return c.read_only || std::ranges::find(kAdapted, c.id) == std::end(kAdapted); });
  return out;
}

}  // namespace

std::vector<Control> controls(const Device& device) {
  std::vector<Control> out;
  v4l2_query_ext_ctrl query{};
  query.id = V4L2_CTRL_FLAG_NEXT_CTRL;
  while (device.call(VIDIOC_QUERY_EXT_CTRL, &query) == 0) {
    if (is_number(query)) {
      const std::string name(query.name, strnlen(query.name, sizeof query.name));
      const bool read_only = (query.flags & V4L2_CTRL_FLAG_READ_ONLY) != 0;
      out.push_back({query.id, plain_name(name), query.minimum, query.maximum, read_only});
    }
    query.id |= V4L2_CTRL_FLAG_NEXT_CTRL;
  }
  return out;
}

std::int64_t value_of(const Device& device, const Control& control) {
  v4l2_ext_control one{};
  one.id = control.id;
  v4l2_ext_controls request = request_of(one);
  device.demand(VIDIOC_G_EXT_CTRLS, &request, control.name);
  return is_wide(device, control.id) ? one.value64 : one.value;
}

double set_exposure_us(const Device& device, double exposure_us) {
  const std::vector<Control> all = controls(device);
  const Control* control = find(all, V4L2_CID_EXPOSURE_ABSOLUTE);
  refuse_if(control == nullptr,
            "exposure_us: found a camera whose exposure is not known in time, allowed: controls by its names");
  set_within(device, *control, exposure_us / kExposureUnit_us, "exposure_us / 100");
  return kExposureUnit_us * static_cast<double>(value_of(device, *control));
}

bool may_adapt(const Device& device, capture::Stream stream, const CameraSettings& settings) {
  if (stream != capture::Stream::color || settings.exposure_us || settings.gain) return false;
  const std::vector<Control> all = controls(device);
  const auto stated = [&](std::uint32_t id) {
    const Control* control = find(all, id);
    return control != nullptr &&
           std::ranges::any_of(settings.controls, [&](const auto& c) { return plain_name(c.first) == control->name; });
  };
  return std::ranges::any_of(kAutomatic, [&](std::uint32_t id) { return find(all, id) != nullptr; }) &&
         std::ranges::none_of(kAutomatic, stated) && std::ranges::none_of(kAdapted, stated);
}

AdaptedValues let_adapt(const Device& device) {
  AdaptedValues before;
  for (const Control& control : adapted_controls(device)) before.push_back(value_of(device, control));
  if (set(device, V4L2_CID_EXPOSURE_AUTO, V4L2_EXPOSURE_APERTURE_PRIORITY) != 0) {
    set(device, V4L2_CID_EXPOSURE_AUTO, V4L2_EXPOSURE_AUTO);
  }
  set(device, V4L2_CID_AUTOGAIN, 1);
  set(device, V4L2_CID_AUTO_WHITE_BALANCE, 1);
  return before;
}

std::string hold(const Device& device, const AdaptedValues& before) {
  const std::vector<Control> adapted = adapted_controls(device);
  AdaptedValues reached;
  for (const Control& control : adapted) reached.push_back(value_of(device, control));
  fix_radiance(device, controls(device), capture::Stream::color);
  std::vector<std::string> names;
  for (std::size_t i = 0; i < std::min(reached.size(), before.size()); ++i) {
    if (reached[i] == before[i]) continue;
    set(device, adapted[i].id, reached[i]);
    const bool exposure = adapted[i].id == V4L2_CID_EXPOSURE_ABSOLUTE;
    names.push_back(exposure ? formatted("exposure_us = %.0f", kExposureUnit_us * static_cast<double>(reached[i]))
                             : adapted[i].name + " = " + std::to_string(reached[i]));
  }
  return listed(names);
}

std::optional<double> set_controls(const Device& device, capture::Stream stream, const CameraSettings& settings) {
  const std::vector<Control> all = controls(device);
  const bool depth = stream == capture::Stream::depth;  // its camera may go on adapting itself to the light
  if (!depth) {
    fix_radiance(device, all, stream);
  } else if (settings.exposure_us) {
    fix_exposure(device, all, stream);
  }
  std::optional<double> exposure_us;
  if (settings.exposure_us) exposure_us = set_exposure_us(device, *settings.exposure_us);
  if (settings.gain) {
    const Control* gain = find(all, V4L2_CID_GAIN);
    gain = gain != nullptr ? gain : find(all, V4L2_CID_ANALOGUE_GAIN);
    refuse_if(gain == nullptr, "gain: found a camera without");
    set_within(device, *gain, *settings.gain, "gain");
  }
  for (const auto& [name, value] : settings.controls) {
    const std::string wanted = plain_name(name);
    const auto found = std::find_if(all.begin(), all.end(), [&](const Control& c) { return c.name == wanted; });
    refuse_if(found == all.end(), "controls." + name + ": found no such number among the camera's controls");
    set_within(device, *found, value, "controls." + name);
  }
  return exposure_us;
}

}  // namespace lumigraft::capture::v4l2
