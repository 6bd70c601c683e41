#pragma once
// Cameras that are there and may not be opened.
#include <vector>

#include "capture/live/camera_list.h"
#include "capture/session/session.h"
#include "server/commands/doctor/report.h"

namespace lumigraft::server {

/// `session`: whose cameras must be usable if they are there; null: any may be unusable.
void check_cameras(DoctorReport& report, const std::vector<capture::CameraListing>& cameras,
                   const capture::Session* session);

}  // namespace lumigraft::server
