#pragma once
// `lumigraft devices`: lists the connected cameras, as text or JSON.
#include <ostream>
#include <vector>

#include "capture/live/camera_list.h"

namespace lumigraft::server {

void write_devices_text(std::ostream& out, const std::vector<capture::CameraListing>& cameras);
void write_devices_json(std::ostream& out, const std::vector<capture::CameraListing>& cameras);

}  // namespace lumigraft::server
