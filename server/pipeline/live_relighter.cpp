#include "server/pipeline/live_relighter.h"

#include <algorithm>
#include <utility>

#include "server/pipeline/camera_picture.h"
#include "server/pipeline/parameters.h"

namespace lumigraft::server {

LiveRelighter::LiveRelighter(const capture::Session& session, const relight::Plan& plan, MakeDevice make_device)
    : session_(session),
      plan_(plan),
      make_device_(std::move(make_device)),
      upload_models_(std::make_shared<relight::UploadModels>(relight::make_upload_model)),
      ray_models_(std::make_shared<relight::RayModels>(relight::make_ray_model)),
      choice_(session.color.model),
      held_depth_(session.color.model) {
  if (plan.on_device()) {
    make_on_device();
  } else {
    wants_rays_ = draws_rays_ = true;
    by_rays_ = std::make_shared<relight::RayRenderer>(session_, relight::RayRenderer::Rooms::taken, ray_models_);
  }
}

void LiveRelighter::make_on_device() {
  std::shared_ptr<relight::gpu::Device> device = make_device_();
  chooses_ = plan_.adaptive == 1 && !plan_.user_set.contains("method") && device->is_software();
  on_device_ = std::make_unique<relight::Relighter>(std::move(device), session_, upload_models_);
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
  if (!wants_rays_ || !scene.field || !scene.illumination) return false;
  std::lock_guard lock(rays_mutex_);
  return !prepared_ || !prepared_->has_surfaces_of(scene);
}

void LiveRelighter::prepare(const reconstruct::Scene& scene) {
  std::unique_lock lock(rays_mutex_);
  const std::shared_ptr<relight::RayRenderer> rays = by_rays_;
  if (!rays) return;
  lock.unlock();
  std::shared_ptr<const relight::RayRoom> room = rays->room_of(scene);
  lock.lock();
  if (by_rays_ == rays) prepared_ = std::move(room);
}

bool LiveRelighter::wants_models(const relight::Exhibit& exhibit) const {
  return wants_rays_ ? ray_models_->wants(exhibit) : upload_models_->wants(exhibit);
}

void LiveRelighter::prepare_model(const relight::Exhibit& exhibit) {
  if (wants_rays_)
    ray_models_->prepare_next(exhibit);
  else
    upload_models_->prepare_next(exhibit);
}

/// Whether all that is to be seen is prepared for a method.
template <typename Prepared>
static bool all_prepared(const relight::PreparedModels<Prepared>& models, const relight::Exhibit& exhibit) {
  std::vector<std::string> preparing;
  only_prepared(exhibit, models, &preparing);
  return preparing.empty();
}

bool LiveRelighter::rays_are_ready(const reconstruct::Scene& scene, const relight::Exhibit& exhibit) const {
  std::lock_guard lock(rays_mutex_);
  return prepared_ && scene.illumination && all_prepared(*ray_models_, exhibit);
}

/// The method for this frame.
void LiveRelighter::choose(const reconstruct::Scene& scene, const relight::Exhibit& exhibit, std::int64_t time_ns) {
  const bool wants_rays = choice_.wants_rays(exhibit, scene.pose, time_ns);
  if (wants_rays && !by_rays_) {
    auto rays = std::make_shared<relight::RayRenderer>(session_, relight::RayRenderer::Rooms::taken, ray_models_);
    std::lock_guard lock(rays_mutex_);
    by_rays_ = std::move(rays);
  }
  wants_rays_ = wants_rays;
  if (!drawn_ || (wants_rays ? rays_are_ready(scene, exhibit) : all_prepared(*upload_models_, exhibit)))
    draws_rays_ = wants_rays;
  if (!draws_rays_ && !wants_rays && by_rays_) {
    std::lock_guard lock(rays_mutex_);
    by_rays_ = nullptr;
    prepared_ = drawn_with_ = nullptr;
  }
}

relight::RelitPicture LiveRelighter::draw(const capture::FrameSet& frame, const reconstruct::Scene& scene,
                                          const relight::Exhibit& exhibit, const relight::Plan& plan) {
  if (draws_rays_) return by_rays_->relight(frame, scene, exhibit, chooses_ ? relight::by_rays(plan) : plan);
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
    if (chooses_) choose(scene, exhibit, frame.time_ns);
    if (!draws_rays_ && !on_device_ && !gave_up() && std::chrono::steady_clock::now() >= next_try_) make_on_device();
    if (draws_rays_) {
      std::lock_guard lock(rays_mutex_);
      if (prepared_ && prepared_ != drawn_with_) by_rays_->take(drawn_with_ = prepared_);
      result.up_to_date = prepared_ && prepared_->has_surfaces_of(scene);
    }
    if (draws_rays_ || on_device_) {
      result.picture = draw(frame, scene, exhibit, plan);
      drawn_ = drawn_ || !result.picture.passed_through;
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
