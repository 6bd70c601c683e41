#include "capture/error.h"
#include "capture/live/camera_list.h"
#include "capture/live/v4l2/controls.h"
#include "capture/live/v4l2/device.h"
#include "capture/live/v4l2/input.h"

namespace lumigraft::capture {
namespace {

/// Reads without changing the camera's state: another program may use it.
void list_inputs(const v4l2::Device& device, CameraListing& listing) {
  const std::vector<v4l2::Input> all = v4l2::inputs(device);
  const std::optional<v4l2::Input> chosen = v4l2::selected_input(device);
  if (all.size() < 2 && !(chosen && chosen->digital)) return;
  for (const v4l2::Input& input : all) {
    const bool now = chosen && chosen->index == input.index;
    listing.inputs.push_back({input.name, now, now ? v4l2::signal_text(device) : ""});
  }
}

void list_device(const v4l2::Device& device, CameraListing& listing) {
  list_inputs(device, listing);
  for (const std::uint32_t fourcc : v4l2::formats(device)) {
    const std::optional<PixelFormat> format = v4l2::pixel_format_of(fourcc);
    const std::string name = format ? std::string(name_of(*format)) : "V4L2 " + v4l2::fourcc_text(fourcc);
    for (const v4l2::Size& size : v4l2::sizes(device, fourcc).each) {
      listing.formats.push_back({name, size.width, size.height, v4l2::highest_rate_hz(device, fourcc, size)});
    }
  }
  for (const v4l2::Control& control : v4l2::controls(device)) {
    // Named as in a configuration, which has a key of its own for the exposure.
    const bool exposure = control.id == V4L2_CID_EXPOSURE_ABSOLUTE;
    const double unit = exposure ? v4l2::kExposureUnit_us : 1.0;
    listing.controls.push_back({exposure ? "exposure_us" : control.name, unit * static_cast<double>(control.low),
                                unit * static_cast<double>(control.high),
                                unit * static_cast<double>(v4l2::value_of(device, control))});
  }
}

}  // namespace

std::vector<CameraListing> list_v4l2_cameras() {
  std::vector<CameraListing> out;
  for (const std::string& node : v4l2::nodes()) {
    CameraListing listing{.source = "v4l2:" + v4l2::persistent_name(node), .name = node, .nodes = {node}};
    try {
      const v4l2::Device device(node);
      listing.name = device.card() + ", " + node;
      list_device(device, listing);
    } catch (const InputError& e) {
      listing.rejection_reason = e.what();
    }
    out.push_back(std::move(listing));
  }
  return out;
}

}  // namespace lumigraft::capture
