#include "server/commands/doctor/camera_checks.h"

#include <algorithm>

#include "capture/live/usb_permission.h"
#include "capture/session/source_uri.h"
#include "server/commands/doctor/permissions.h"

namespace lumigraft::server {
namespace {

constexpr const char* kMend_usb =
    "lsusb shows the camera's VENDOR:PRODUCT; a file /etc/udev/rules.d/70-lumigraft.rules with the line "
    "SUBSYSTEM==\"usb\", ATTR{idVendor}==\"VENDOR\", MODE=\"0660\", GROUP=\"video\"; then sudo udevadm control "
    "--reload "
    "&& sudo udevadm trigger";

std::string mend(const capture::CameraListing& camera) {
  for (const std::string& node : camera.nodes)
    if (!may_use(node)) return mend_node(node);
  return camera.rejection_reason.find(capture::kForbiddenUsb) != std::string::npos ? kMend_usb : "";
}

std::vector<std::string> sources_of(const capture::Session& session) {
  std::vector<std::string> sources{session.color.source};
  if (session.depth) sources.push_back(session.depth->source);
  if (session.fisheye) sources.push_back(session.fisheye->source);
  return sources;
}

/// Whether one of the sources means this camera: by its name, or the first of its kind.
bool means(const std::vector<std::string>& sources, const capture::CameraListing& camera) {
  return std::ranges::any_of(sources, [&](const std::string& source) {
    return source == camera.source || (source.ends_with(':') && camera.source.starts_with(source));
  });
}

}  // namespace

void check_cameras(DoctorReport& report, const std::vector<capture::CameraListing>& cameras,
                   const capture::Session* session) {
  const std::vector<std::string> wanted = session ? sources_of(*session) : std::vector<std::string>{};
  for (const capture::CameraListing& camera : cameras) {
    const std::string what = "camera " + camera.source;
    if (camera.rejection_reason.empty())
      report.ok(what, camera.name);
    else if (means(wanted, camera))
      report.missing(what, camera.rejection_reason, mend(camera));
    else
      report.note(what, camera.rejection_reason, mend(camera));
  }
  for (const std::string& source : wanted) {
    const auto uri = capture::parse_source(source);
    const bool listed = uri && uri->live && uri->kind != "helper";
    if (listed && std::ranges::none_of(cameras, [&](const auto& camera) { return means({source}, camera); }))
      report.note("camera " + source, "not found; serve waits for it",
                  "`lumigraft devices` lists the sources that are there");
  }
  if (cameras.empty() && wanted.empty()) report.line("cameras: none found");
}

}  // namespace lumigraft::server
