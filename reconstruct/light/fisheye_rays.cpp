#include "reconstruct/light/fisheye_rays.h"

namespace lumigraft::reconstruct {

FisheyeView fisheye_view(const capture::FisheyeCamera& camera) {
  const capture::CameraModel& model = camera.model;
  FisheyeView view;
  view.width = model.width;
  view.height = model.height;
  const std::size_t pixels = static_cast<std::size_t>(model.width) * model.height;
  view.direction.assign(pixels, Eigen::Vector3f::Zero());
  view.solid_angle_sr.assign(pixels, 0.0f);
  const Eigen::Matrix3d R_tag_fisheye = camera.T_tag_fisheye.linear();
  for (int v = 0; v < model.height; ++v) {
    for (int u = 0; u < model.width; ++u) {
      const auto direction = model.unproject(Eigen::Vector2d(u, v));
      if (!direction) continue;
      const std::size_t pixel = static_cast<std::size_t>(v) * model.width + u;
      view.direction[pixel] = (R_tag_fisheye * *direction).cast<float>();
      view.solid_angle_sr[pixel] = static_cast<float>(model.solid_angle_sr(u, v));
    }
  }
  return view;
}

}  // namespace lumigraft::reconstruct
