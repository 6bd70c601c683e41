#include "server/pipeline/live_relighter.h"

#include <algorithm>
#include <utility>

#include "relight/relighter.h"
#include "server/pipeline/camera_picture.h"
#include "server/pipeline/parameters.h"

namespace lumigraft::server {

LiveRelighter::LiveRelighter(const capture::Session& session, const relight::Plan& plan, MakeDevice make_device)
    : session_(session), plan_(plan), make_device_(std::move(make_device)) {
  if (plan.on_device())
    upload_models_ = std::make_shared<relight::UploadModels>(relight::make_upload_model);
  else
    ray_models_ = std::make_shared<relight::RayModels>(relight::make_ray_model);
  make();
}

void LiveRelighter::make() {
  if (plan_.on_device()) {
    renderer_ = std::make_unique<relight::Relighter>(make_device_(), session_, upload_models_);
    return;
  }
  auto rays = std::make_unique<relight::RayRenderer>(session_, relight::RayRenderer::Rooms::taken, ray_models_);
  rays_ = rays.get();
  renderer_ = std::move(rays);
}

bool LiveRelighter::wants_prepared(const reconstruct::Scene& scene) const {
  if (!scene.field || !scene.illumination) return false;
  std::lock_guard lock(prepared_mutex_);
  return !prepared_ || !prepared_->has_surfaces_of(scene);
}

void LiveRelighter::prepare(const reconstruct::Scene& scene) {
  std::shared_ptr<const relight::RayRoom> room = rays_->room_of(scene);
  std::lock_guard lock(prepared_mutex_);
  prepared_ = std::move(room);
}

bool LiveRelighter::wants_models(const relight::Exhibit& exhibit) const {
  return upload_models_ ? upload_models_->wants(exhibit) : ray_models_->wants(exhibit);
}

void LiveRelighter::prepare_model(const relight::Exhibit& exhibit) {
  if (upload_models_)
    upload_models_->prepare_next(exhibit);
  else
    ray_models_->prepare_next(exhibit);
}

LiveRelighter::Result LiveRelighter::relight(const capture::FrameSet& frame, const reconstruct::Scene& scene,
                                             const relight::Exhibit& exhibit, const relight::Plan& plan) {
  Result result;
  if (frame.color->encoded.empty())
    fade_.follow(frame, camera_picture(*frame.color), scene.pose);
  else
    fade_.follow(frame, frame.color->encoded, scene.pose);
  if (fade_.covered()) {
    result.picture.srgb = camera_picture(*frame.color);
    result.picture.plan = plan;
    result.picture.passed_through = fade_.opacity() <= 0;
    result.picture.warnings = {"relight: the colour camera's lens is covered, or it is dark: objects fade out"};
    fade_.add_last(&result.picture.srgb);
    return result;
  }
  try {
    if (!renderer_ && std::chrono::steady_clock::now() >= next_try_) make();
    if (rays_) {
      std::lock_guard lock(prepared_mutex_);
      if (prepared_ && prepared_ != drawn_with_) rays_->take(drawn_with_ = prepared_);
      result.up_to_date = prepared_ && prepared_->has_surfaces_of(scene);
    }
    if (renderer_) {
      result.picture = renderer_->relight(frame, scene, exhibit, plan);
      pause_ = std::chrono::seconds(0);
      failure_.clear();
      if (result.picture.passed_through)
        fade_.forget_last();
      else
        fade_.apply(result.picture.camera, &result.picture.srgb);
    }
  } catch (const relight::gpu::GpuError& e) {
    renderer_.reset();  // frees the device before another is created
    next_try_ = std::chrono::steady_clock::now() + pause_;
    pause_ = std::clamp(2 * pause_, kPipeline.first_pause, kPipeline.longest_pause);
    failure_ = std::string("the GPU device failed and is created again: ") + e.what();
  } catch (const std::exception& e) {
    failure_ = std::string("relight: ") + e.what();
  }
  if (!failure_.empty()) result.picture.warnings.push_back(failure_);
  if (result.picture.srgb.empty()) {
    fade_.forget_last();
    result.picture.srgb = camera_picture(*frame.color);
    result.picture.plan = plan;
    result.picture.passed_through = true;
  }
  return result;
}

}  // namespace lumigraft::server
