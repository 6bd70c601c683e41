#pragma once
// Gives the objects the sharpness of the camera picture around them.
#include "relight/compose/object_layer.h"

namespace lumigraft::relight {

/// The layer as a camera with a Gaussian blur of `sigma_px` sees it; its window is what they cover, grown within the
/// image of `width` × `height` pixels. `distance_m` of pixels that the blur newly covers is the largest around them.
ObjectLayer softened(const ObjectLayer& objects, float sigma_px, int width, int height);

}  // namespace lumigraft::relight
