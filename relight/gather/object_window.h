#pragma once
// Where in the picture the objects can be.
#include "relight/gather/gbuffer.h"

namespace lumigraft::relight {

/// Pixels of the picture.
struct PixelWindow {
  int left = 0, top = 0, width = 0, height = 0;
};

/// Around all pixels with rays that come near these spheres (x, y, z, radius; tag frame); left and top are multiples of
/// sixteen.
PixelWindow window_of(const std::vector<Eigen::Vector4f>& spheres, const CameraRays& eye);

}  // namespace lumigraft::relight
