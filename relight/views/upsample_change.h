#pragma once
// The change of light on real surfaces at every pixel, from a view at a fraction of the image size.
#include "relight/compose/current_depth.h"
#include "relight/compose/object_layer.h"
#include "relight/passes/screen/camera_upload.h"
#include "relight/views/view_light.h"

namespace lumigraft::relight {

struct FullChange {
  capture::Image<float> change, radiance;  ///< 3 channels, of the camera's size, W/sr/m²; 0 where nothing changes
};

/// Joint bilateral upsampling (Kopf et al. 2007) of the change over the radiance, as a change of irradiance multiplies
/// what the picture shows: texture is that of the picture. Where the four values around a pixel differ visibly, those
/// count whose surface goes through the pixel's depth, and that `objects` do not cover: a contact shadow ends at the
/// object's outline. On glossy surfaces, and where the picture is dark, the change itself is interpolated. Clipped
/// channels of `picture` get the radiance that was restored for them.
void upsample(const RoomInView& low, const CameraRays& eye, const CurrentDepth& depth, const ObjectLayer& objects,
              const CameraUpload& picture, FullChange& full);

}  // namespace lumigraft::relight
