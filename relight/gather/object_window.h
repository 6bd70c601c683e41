#pragma once
// The part of the image that may show objects.
#include "relight/gather/gbuffer.h"

namespace lumigraft::relight {

/// Rectangle of pixels.
struct PixelWindow {
  int left = 0, top = 0, width = 0, height = 0;
};

/// Encloses all pixels whose rays pass near these spheres (x, y, z, radius; tag frame); left and top are multiples of
/// sixteen.
PixelWindow window_of(const std::vector<Eigen::Vector4f>& spheres, const CameraRays& eye);

}  // namespace lumigraft::relight
