#include "relight/compose/sampled_depth.h"

namespace lumigraft::relight {
namespace {

capture::CameraModel sampled(capture::CameraModel camera, int step) {
  camera.width = (camera.width - step / 2 - 1) / step + 1;
  camera.height = (camera.height - step / 2 - 1) / step + 1;
  camera.fx /= step;
  camera.fy /= step;
  camera.cx = (camera.cx - step / 2) / step;
  camera.cy = (camera.cy - step / 2) / step;
  return camera;
}

}  // namespace

SampledDepth::SampledDepth(const capture::CameraModel& camera, int step)
    : step_(step), model_(sampled(camera, step)), rays_(model_) {}

const capture::Image<float>& SampledDepth::sample(const capture::Image<float>& depth_m) {
  if (step_ == 1) return depth_m;
  if (sampled_m_.empty()) sampled_m_ = capture::Image<float>(model_.width, model_.height, 1);
  for (int v = 0; v < model_.height; ++v) {
    for (int u = 0; u < model_.width; ++u) {
      sampled_m_.at(u, v) = depth_m.at(u * step_ + step_ / 2, v * step_ + step_ / 2);
    }
  }
  return sampled_m_;
}

}  // namespace lumigraft::relight
