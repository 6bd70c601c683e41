#include "capture/live/aravis/library.h"
#include "capture/live/camera_list.h"
#include "capture/live/usb_permission.h"

namespace lumigraft::capture {
namespace {

using aravis::Check;

void list_device(ArvCamera* camera, CameraListing& listing) {
  Check check;
  gint width = 0, height = 0;
  arv_camera_get_sensor_size(camera, &width, &height, check);
  check.or_throw("size");
  double slowest_hz = 0.0, fastest_hz = 0.0;
  if (arv_camera_is_frame_rate_available(camera, check)) {
    arv_camera_get_frame_rate_bounds(camera, &slowest_hz, &fastest_hz, check);
    check.or_throw("rate");
  }
  for (const gint64 offered : aravis::pixel_formats_of(camera)) {
    const auto format = aravis::pixel_format_of(offered);
    listing.formats.push_back(
        {format ? std::string(name_of(*format)) : "GenICam " + std::to_string(offered), width, height, fastest_hz});
  }
  const auto list_control = [&](const char* name, auto* available, auto* bounds, auto* value) {
    if (!available(camera, check)) return;
    OfferedControl control{.name = name};
    bounds(camera, &control.low, &control.high, check);
    control.value = value(camera, check);
    check.or_throw(name);
    listing.controls.push_back(control);
  };
  list_control("exposure_us", arv_camera_is_exposure_time_available, arv_camera_get_exposure_time_bounds,
               arv_camera_get_exposure_time);
  list_control("gain", arv_camera_is_gain_available, arv_camera_get_gain_bounds, arv_camera_get_gain);
}

}  // namespace

std::vector<CameraListing> list_aravis_cameras() {
  std::vector<CameraListing> out;
  arv_update_device_list();
  for (unsigned i = 0; i < arv_get_n_devices(); ++i) {
    const auto text = [](const char* word) { return std::string(word != nullptr ? word : ""); };
    const std::string id = text(arv_get_device_id(i));
    CameraListing listing{.source = "aravis:" + id,
                          .name = text(arv_get_device_vendor(i)) + " " + text(arv_get_device_model(i)) + " " +
                                  text(arv_get_device_serial_nbr(i)) + ", " + text(arv_get_device_protocol(i))};
    try {
      Check check;
      const aravis::Ref<ArvCamera> camera(arv_camera_new(id.c_str(), check));
      check.or_throw("open");
      list_device(camera.get(), listing);
    } catch (const InputError& e) {
      listing.rejection_reason = e.what();
    }
    out.push_back(std::move(listing));
  }
  if (aravis::usb3_vision_is_forbidden()) {
    out.push_back({.source = "aravis:", .name = "a camera of USB3 Vision", .rejection_reason = kForbiddenUsb});
  }
  return out;
}

}  // namespace lumigraft::capture
