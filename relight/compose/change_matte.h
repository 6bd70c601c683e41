#pragma once
// The change of light at outlines of what moved in front of the room: pixels there show two surfaces.
#include "relight/compose/current_depth.h"
#include "relight/compose/object_layer.h"
#include "relight/passes/screen/camera_upload.h"

namespace lumigraft::relight {

/// Where the change of light on a foreground and behind it differ, it becomes α ΔF + (1 - α) ΔB at the foreground's
/// outline, with α as in foreground_matte.h and the means of both sides; behind an object only α ΔF is left. `front`:
/// not 0 where depth shows the foreground; `change`: L_Δ, W/sr/m²; all of the image's size.
void divide_change(const CurrentDepth& depth, const CameraUpload& picture, const capture::Image<std::uint8_t>& front,
                   const ObjectLayer& objects, capture::Image<float>& change);

}  // namespace lumigraft::relight
