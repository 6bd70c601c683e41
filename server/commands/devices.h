#pragma once
// `lumigraft devices`: the cameras that are plugged in, as text or JSON.
#include <ostream>
#include <vector>

#include "capture/live/camera_list.h"

namespace lumigraft {

void write_devices_text(std::ostream& out, const std::vector<CameraListing>& cameras);
void write_devices_json(std::ostream& out, const std::vector<CameraListing>& cameras);

}  // namespace lumigraft
