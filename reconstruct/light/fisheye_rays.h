#pragma once
// Direction and solid angle of each pixel of the fish-eye, in the tag frame.
#include <Eigen/Core>
#include <cstddef>
#include <vector>

#include "capture/session/session.h"

namespace lumigraft::reconstruct {

struct FisheyeView {
  int width = 0;
  int height = 0;
  std::vector<Eigen::Vector3f> direction;  ///< unit, tag frame; zero outside the lens's image
  std::vector<float> solid_angle_sr;       ///< 0 outside the lens's image

  bool sees(std::size_t pixel) const { return solid_angle_sr[pixel] > 0; }
};

FisheyeView fisheye_view(const capture::FisheyeCamera& camera);

}  // namespace lumigraft::reconstruct
