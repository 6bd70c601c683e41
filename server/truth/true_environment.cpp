#include "server/truth/true_environment.h"

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "server/truth/parameters.h"
#include "server/truth/truth.h"

namespace lumigraft::server {
namespace {

/// An omnidirectional fish-eye; each pixel has the solid angle of one at the centre of the session's fish-eye.
capture::FisheyeCamera all_around(const capture::FisheyeCamera& fisheye) {
  capture::FisheyeCamera camera;
  camera.T_tag_fisheye.translation() = fisheye.T_tag_fisheye.translation();
  capture::CameraModel& model = camera.model;
  model.kind = capture::CameraModel::Kind::equidistant;
  model.fx = model.fy = fisheye.model.fx;
  model.width = model.height = static_cast<int>(std::ceil(kTruth.field_rad * model.fx));
  model.cx = model.cy = 0.5 * (model.width - 1);
  model.fov_rad = kTruth.field_rad;
  return camera;
}

}  // namespace

TrueEnvironment::TrueEnvironment(const capture::Session& session)
    : fisheye_(*session.fisheye), environment_{read_true_picture(session.folder / "truth" / "environment.exr")} {
  const std::filesystem::path room = session.folder / "truth" / "real_scene.ply";
  if (std::filesystem::exists(room)) room_.emplace(room);
  capture::Session around;
  around.fisheye = all_around(fisheye_);
  const capture::CameraModel& model = around.fisheye->model;
  auto picture = std::make_shared<capture::Frame>();
  picture->stream = capture::Stream::fisheye;
  picture->radiance = capture::Image<float>(model.width, model.height, 3);
  for (int v = 0; v < model.height; ++v) {
    for (int u = 0; u < model.width; ++u) {
      const Eigen::Vector3f radiance = mean_over_pixel(*around.fisheye, u, v);
      for (int c = 0; c < 3; ++c) picture->radiance.at(u, v, c) = radiance[c];
    }
  }
  capture::FrameSet frame;
  frame.fisheye = {picture};
  lamps_ = reconstruct::LightStage(around).extract(frame).illumination->lights;
}

Eigen::Vector3f TrueEnvironment::mean_over_pixel(const capture::FisheyeCamera& camera, int u, int v) const {
  Eigen::Vector3f sum = Eigen::Vector3f::Zero();
  int seen = 0;
  for (int i = 0; i < kTruth.samples * kTruth.samples; ++i) {
    const double x = (i % kTruth.samples + 0.5) / kTruth.samples - 0.5,
                 y = (i / kTruth.samples + 0.5) / kTruth.samples - 0.5;
    const auto w = camera.model.unproject({u + x, v + y});
    if (!w) continue;
    sum += environment_.sample((camera.T_tag_fisheye.linear() * *w).cast<float>());
    ++seen;
  }
  return seen > 0 ? (sum / static_cast<float>(seen)).eval() : sum;
}

void TrueEnvironment::complete(capture::RadianceImage& picture) const {
  const Eigen::Vector3f probe_m = fisheye_.T_tag_fisheye.translation().cast<float>();
  for (int v = 0; v < picture.radiance.height; ++v) {
    for (int u = 0; u < picture.radiance.width; ++u) {
      const auto w = fisheye_.model.unproject({u, v});
      if (!picture.clipped.at(u, v, 0) || !w) continue;
      if (room_ && room_->hides(probe_m, (fisheye_.T_tag_fisheye.linear() * *w).cast<float>())) continue;
      const Eigen::Vector3f radiance = mean_over_pixel(fisheye_, u, v);
      for (int c = 0; c < 3; ++c) picture.radiance.at(u, v, c) = std::max(picture.radiance.at(u, v, c), radiance[c]);
      picture.clipped.at(u, v, 0) = 0;
    }
  }
}

}  // namespace lumigraft::server
