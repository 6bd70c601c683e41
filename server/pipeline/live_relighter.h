#pragma once
// Renderer of a service: after a failure the device is created again; until that succeeds the camera image is passed
// through with a warning. After some that hang none is created any more. While the camera's pose or picture is missing,
// or when depth stops, objects fade out (compose/change_fade.h).
//
// Instead of a software device rays draw, unless the user chose the method or a fixed plan: they are several times as
// fast there, or nearer to the truth.
#include <atomic>
#include <chrono>
#include <functional>
#include <memory>
#include <mutex>

#include "relight/compose/change_fade.h"
#include "relight/compose/held_depth.h"
#include "relight/relighter.h"
#include "relight/upload/upload_model.h"
#include "relight/views/live_ray_renderer.h"

namespace lumigraft::server {

class LiveRelighter {
 public:
  /// Null in place of a software device, where rays may draw.
  using MakeDevice = std::function<std::shared_ptr<relight::gpu::Device>()>;

  /// Whether rays draw where there is no other than a software device.
  static bool rays_may_draw(const relight::Plan& plan);

  /// Creates the first device if the plan's method needs one. Throws gpu::GpuError, InputError.
  LiveRelighter(const capture::Session& session, const relight::Plan& plan, MakeDevice make_device);

  struct Result {
    relight::RelitPicture picture;
    bool up_to_date = true;  ///< false: the scene has surfaces that are not prepared yet
  };
  /// Whether so many devices have hung that none is made any more. Any thread.
  bool gave_up() const;
  /// Whether rays draw, which need `prepare`.
  bool draws_prepared() const { return by_rays_ != nullptr; }
  /// Whether rays draw, and the scene contains surfaces that are not prepared. Any thread.
  bool wants_prepared(const reconstruct::Scene& scene) const;
  /// Prepares the scene's surfaces for later calls of `relight`, also during one; takes tenths of a second. One thread.
  void prepare(const reconstruct::Scene& scene);

  /// Whether a model of the exhibit is not prepared for rendering. Any thread.
  bool wants_models(const relight::Exhibit& exhibit) const;
  /// Prepares one for later calls of `relight`, also during one; takes up to seconds. One thread.
  void prepare_model(const relight::Exhibit& exhibit);

  /// Objects whose models are not prepared are not drawn. Never throws.
  Result relight(const capture::FrameSet& frame, const reconstruct::Scene& scene, const relight::Exhibit& exhibit,
                 const relight::Plan& plan);

 private:
  void make_on_device();
  void device_failed(const relight::gpu::GpuError& error);
  relight::RelitPicture draw(const capture::FrameSet& frame, const reconstruct::Scene& scene,
                             const relight::Exhibit& exhibit, const relight::Plan& plan);

  capture::Session session_;
  relight::Plan plan_;
  MakeDevice make_device_;
  std::shared_ptr<relight::UploadModels> upload_models_;
  std::shared_ptr<relight::RayModels> ray_models_;
  std::unique_ptr<relight::Relighter> on_device_;      ///< null if the plan needs none, and after a failure
  std::unique_ptr<relight::LiveRayRenderer> by_rays_;  ///< null if a device draws

  mutable std::mutex prepared_mutex_;
  std::shared_ptr<const relight::RayRoom> prepared_;    ///< guarded by it
  std::shared_ptr<const relight::RayRoom> drawn_with_;  ///< what by_rays_ has

  relight::ChangeFade fade_;
  relight::HeldDepth held_depth_;
  std::string failure_;
  std::chrono::steady_clock::time_point next_try_{};
  std::chrono::seconds pause_{0};
  std::atomic<int> hangs_ = 0;
};

}  // namespace lumigraft::server
