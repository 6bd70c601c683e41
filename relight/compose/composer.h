#pragma once
// The final frame on the CPU (thesis eq. 3.4): camera image plus change where it shows the real room, virtual radiance
// where it shows an object, blended by coverage.
#include "capture/image.h"
#include "relight/compose/object_layer.h"
#include "relight/passes/screen/camera_upload.h"

namespace lumigraft::relight {

/// Light of a pixel; `objects`: their radiance times coverage.
template <typename Light>
Light composed(Light room, Light objects, Light coverage) {
  return (1 - coverage) * room + objects;
}

struct RoomChange {
  const capture::Image<float>& delta;  ///< L_Δ, W/sr/m²
  /// Of the frame for which it was computed, clipped pixels restored; null: not known.
  const capture::Image<float>* radiance = nullptr;
  /// L_Δ is proportional to the pixel's radiance of now: the camera's noise is darkened or brightened with the surface.
  bool proportional = false;
};

/// A clipped channel counts as the radiance that was restored, if that is more. A pixel's
/// change or radiance that is not finite counts as 0. `picture`: the camera's, as coded(); pixels without change keep
/// their pixel values.
void compose(const CameraUpload& camera, const RoomChange& change, const ObjectLayer& objects,
             capture::Image<std::uint8_t>* picture);

}  // namespace lumigraft::relight
