#pragma once
// Relight for a service that goes on: a device that fails is made again, and until it works the camera's picture passes
// through with a warning.
#include <chrono>
#include <functional>
#include <memory>
#include <mutex>

#include "relight/gather/ray_renderer.h"

namespace lumigraft::server {

class LiveRelighter {
 public:
  using MakeDevice = std::function<std::shared_ptr<relight::gpu::Device>()>;

  /// Makes the first device, where the plan is drawn on one. Throws gpu::GpuError, InputError.
  LiveRelighter(const capture::Session& session, const relight::Plan& plan, MakeDevice make_device);

  struct Result {
    relight::RelitPicture picture;
    bool passed_through = false;  ///< nothing was grafted
    bool up_to_date = true;       ///< else the scene has surfaces that are not prepared yet
  };
  /// Whether `prepare` is needed, as by rays.
  bool draws_prepared() const { return rays_ != nullptr; }
  /// Then: whether there is something new in the scene to prepare. Any thread.
  bool wants_prepared(const reconstruct::Scene& scene) const;
  /// Takes some tenths of a second beside `relight`, which draws from then on with what this made. One thread.
  void prepare(const reconstruct::Scene& scene);

  /// Never throws.
  Result relight(const capture::FrameSet& frame, const reconstruct::Scene& scene, const relight::Exhibit& exhibit,
                 const relight::Plan& plan);

 private:
  void make();

  capture::Session session_;
  relight::Plan plan_;
  MakeDevice make_device_;
  std::unique_ptr<relight::Renderer> renderer_;
  relight::RayRenderer* rays_ = nullptr;  ///< the renderer, where it draws by rays

  mutable std::mutex prepared_mutex_;
  std::shared_ptr<const relight::RayRoom> prepared_, drawn_with_;

  std::string failure_;
  std::chrono::steady_clock::time_point next_try_{};
  std::chrono::seconds pause_{0};
};

}  // namespace lumigraft::server
