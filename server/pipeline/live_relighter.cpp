#include "server/pipeline/live_relighter.h"

#include <algorithm>
#include <utility>

#include "server/pipeline/camera_picture.h"
#include "server/pipeline/parameters.h"

namespace lumigraft::server {

bool LiveRelighter::rays_may_draw(const relight::Plan& plan) {
  return plan.on_device() && plan.adaptive == 1 && !plan.user_set.contains("method");
}

LiveRelighter::LiveRelighter(const capture::Session& session, const relight::Plan& plan, MakeDevice make_device)
    : session_(session),
      plan_(plan),
      make_device_(std::move(make_device)),
      upload_models_(std::make_shared<relight::UploadModels>(relight::make_upload_model)),
      ray_models_(std::make_shared<relight::RayModels>(relight::make_ray_model)),
      held_depth_(session.color.model) {
  bool rays = !plan.on_device();
  if (!rays) {
    std::shared_ptr<relight::gpu::Device> device = make_device_();
    rays = rays_may_draw(plan) && (!device || device->is_software());
    if (!rays) on_device_ = std::make_unique<relight::Relighter>(std::move(device), session_, upload_models_);
  }
  if (rays) by_rays_ = std::make_unique<relight::LiveRayRenderer>(session_, ray_models_);
}

void LiveRelighter::make_on_device() {
  on_device_ = std::make_unique<relight::Relighter>(make_device_(), session_, upload_models_);
}

void LiveRelighter::device_failed(const relight::gpu::GpuError& error) {
  on_device_.reset();  // frees the device before another is created
  next_try_ = std::chrono::steady_clock::now() + pause_;
  pause_ = std::clamp(2 * pause_, kPipeline.first_pause, kPipeline.longest_pause);
  failure_ =
      std::string(gave_up() ? "the GPU device has hung too often and is used again after a restart of the service: "
                            : "the GPU device failed and is created again: ") +
      error.what();
}

bool LiveRelighter::gave_up() const { return hangs_ >= kPipeline.max_hangs; }

bool LiveRelighter::wants_prepared(const reconstruct::Scene& scene) const {
  if (!by_rays_ || !scene.field || !scene.illumination) return false;
  std::lock_guard lock(prepared_mutex_);
  return !prepared_ || !prepared_->has_surfaces_of(scene);
}

void LiveRelighter::prepare(const reconstruct::Scene& scene) {
  std::shared_ptr<const relight::RayRoom> room = by_rays_->room_of(scene);
  const std::lock_guard lock(prepared_mutex_);
  prepared_ = std::move(room);
}

bool LiveRelighter::wants_models(const relight::Exhibit& exhibit) const {
  return by_rays_ ? ray_models_->wants(exhibit) : upload_models_->wants(exhibit);
}

void LiveRelighter::prepare_model(const relight::Exhibit& exhibit) {
  if (by_rays_)
    ray_models_->prepare_next(exhibit);
  else
    upload_models_->prepare_next(exhibit);
}

relight::RelitPicture LiveRelighter::draw(const capture::FrameSet& frame, const reconstruct::Scene& scene,
                                          const relight::Exhibit& exhibit, const relight::Plan& plan) {
  if (by_rays_) return by_rays_->relight(frame, scene, exhibit, plan.on_device() ? relight::by_rays(plan) : plan);
  return on_device_->relight(frame, scene, exhibit, plan);
}

LiveRelighter::Result LiveRelighter::relight(const capture::FrameSet& sensed, const reconstruct::Scene& scene,
                                             const relight::Exhibit& exhibit, const relight::Plan& plan) {
  Result result;
  const capture::FrameSet frame = held_depth_.complete(sensed, scene.pose);
  const bool stopped = held_depth_.stopped();
  if (frame.color->encoded.empty())
    fade_.follow(frame, camera_picture(*frame.color), scene.pose, stopped);
  else
    fade_.follow(frame, frame.color->encoded, scene.pose, stopped);
  if (fade_.covered()) {
    result.picture.srgb = camera_picture(*frame.color);
    result.picture.plan = plan;
    result.picture.passed_through = fade_.opacity() <= 0;
    result.picture.warnings = {"relight: the colour camera's lens is covered, or it is dark: objects fade out"};
    fade_.add_last(&result.picture.srgb);
    return result;
  }
  try {
    if (!by_rays_ && !on_device_ && !gave_up() && std::chrono::steady_clock::now() >= next_try_) make_on_device();
    if (by_rays_) {
      const std::lock_guard lock(prepared_mutex_);
      if (prepared_ && prepared_ != drawn_with_) by_rays_->take(drawn_with_ = prepared_);
    }
    if (by_rays_ || on_device_) {
      result.picture = draw(frame, scene, exhibit, plan);
      if (by_rays_) result.up_to_date = by_rays_->shows_surfaces_of(scene);
      pause_ = std::chrono::seconds(0);
      failure_.clear();
      if (result.picture.passed_through)
        fade_.forget_last();
      else
        fade_.apply(result.picture.camera, &result.picture.srgb);
    }
  } catch (const relight::gpu::DeviceHung& e) {
    ++hangs_;
    device_failed(e);
  } catch (const relight::gpu::GpuError& e) {
    device_failed(e);
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
