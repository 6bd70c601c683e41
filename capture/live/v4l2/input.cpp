#include "capture/live/v4l2/input.h"

#include <algorithm>
#include <cerrno>
#include <cmath>
#include <cstring>

#include "capture/error.h"
#include "capture/live/parameters.h"
#include "capture/message_text.h"

namespace lumigraft::capture::v4l2 {
namespace {

/// Meaning of the errors of VIDIOC_QUERY_DV_TIMINGS; null for others.
const char* signal_fault(int error) {
  switch (error) {
    case ENOLINK:
      return "no signal";
    case ENOLCK:
      return "a signal that is not steady";
    case ERANGE:
      return "a signal that the camera does not support";
    default:
      return nullptr;
  }
}

std::string timings_text(const v4l2_bt_timings& timings) {
  const double pixels = static_cast<double>(V4L2_DV_BT_FRAME_WIDTH(&timings)) * V4L2_DV_BT_FRAME_HEIGHT(&timings);
  return formatted("%ux%u at %.4g Hz", timings.width, timings.height,
                   static_cast<double>(timings.pixelclock) / std::max(pixels, 1.0));
}

/// Grabbers that scale accept any signal, but another aspect ratio would invalidate the camera's calibration.
void check_shape(const v4l2_bt_timings& signal, const StreamSpec& spec, const Input& input) {
  const double wanted = static_cast<double>(spec.width) / spec.height;
  const double found = static_cast<double>(signal.width) / std::max(signal.height, __u32{1});
  refuse_if(std::abs(found - wanted) > kV4l2Parameters.max_aspect_ratio_error * wanted,
            "found a signal of " + timings_text(signal) + " at its input \"" + input.name +
                "\", allowed by the session: " + size_text(spec.width, spec.height) + " or of that shape");
}

/// Sets the driver to the timings of the signal; drivers start with default timings.
void follow_signal(const Device& device, const StreamSpec& spec, const Input& input) {
  v4l2_dv_timings timings{};
  const int error = device.call(VIDIOC_QUERY_DV_TIMINGS, &timings);
  if (const char* why = signal_fault(error)) {
    throw CameraFault(std::string("found ") + why + " at its input \"" + input.name + "\"");
  }
  if (error == 0) {  // else the driver cannot detect timings and keeps those that were set
    check_shape(timings.bt, spec, input);
    device.demand(VIDIOC_S_DV_TIMINGS, &timings, "the signal's timings");
  }
}

}  // namespace

std::vector<Input> inputs(const Device& device) {
  std::vector<Input> out;
  v4l2_input entry{};
  while (device.call(VIDIOC_ENUMINPUT, &entry) == 0) {
    const char* name = reinterpret_cast<const char*>(entry.name);
    out.push_back({entry.index, std::string(name, strnlen(name, sizeof entry.name)),
                   (entry.capabilities & V4L2_IN_CAP_DV_TIMINGS) != 0});
    const __u32 next = entry.index + 1;
    entry = {};
    entry.index = next;
  }
  return out;
}

std::optional<Input> selected_input(const Device& device) {
  int index = 0;
  if (device.call(VIDIOC_G_INPUT, &index) != 0) return std::nullopt;
  for (const Input& input : inputs(device)) {
    if (input.index == static_cast<std::uint32_t>(index)) return input;
  }
  return std::nullopt;
}

std::string signal_text(const Device& device) {
  const std::optional<Input> input = selected_input(device);
  if (!input || !input->digital) return "";
  v4l2_dv_timings timings{};
  const int error = device.call(VIDIOC_QUERY_DV_TIMINGS, &timings);
  if (const char* why = signal_fault(error)) return why;
  return error == 0 ? timings_text(timings.bt) : "";
}

void select_input(const Device& device, const StreamSpec& spec) {
  if (const std::optional<std::string>& name = spec.settings.input) {
    const std::vector<Input> all = inputs(device);
    const auto wanted = std::find_if(all.begin(), all.end(), [&](const Input& i) { return i.name == *name; });
    if (wanted == all.end()) {
      std::vector<std::string> names;
      for (const Input& input : all) names.push_back("\"" + input.name + "\"");
      throw InputError("input: found \"" + *name + "\", allowed: " +
                       (names.empty() ? "none, since it has no inputs to choose from" : listed(names)));
    }
    int index = static_cast<int>(wanted->index);
    device.demand(VIDIOC_S_INPUT, &index, "input");
  }
  if (const std::optional<Input> input = selected_input(device); input && input->digital) {
    follow_signal(device, spec, *input);
  }
}

}  // namespace lumigraft::capture::v4l2
