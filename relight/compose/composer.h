#pragma once
// The final frame on the CPU (thesis eq. 3.4): camera image plus change where it shows the real room, virtual radiance
// where it shows an object, blended by coverage.
#include "capture/image.h"
#include "relight/compose/object_layer.h"
#include "relight/passes/screen/camera_upload.h"

namespace lumigraft::relight {

/// Light of a pixel; `objects`: their radiance times coverage.
inline float composed(float room, float objects, float coverage) { return (1 - coverage) * room + objects; }

/// `change`: L_Δ of the room, W/sr/m². A pixel's change or radiance that is not finite counts as 0. `picture`: the
/// camera's, as coded(); pixels without change keep their pixel values.
void compose(const CameraUpload& camera, const capture::Image<float>& change, const ObjectLayer& objects,
             capture::Image<std::uint8_t>* picture);

}  // namespace lumigraft::relight
