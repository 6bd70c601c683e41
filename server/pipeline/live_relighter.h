#pragma once
// Renderer of a service: after a failure the device is created again; until that succeeds the camera image is passed
// through with a warning. While the camera's pose or picture is missing, objects fade out (compose/change_fade.h).
#include <chrono>
#include <functional>
#include <memory>
#include <mutex>

#include "relight/compose/change_fade.h"
#include "relight/gather/ray_renderer.h"
#include "relight/upload/upload_model.h"

namespace lumigraft::server {

class LiveRelighter {
 public:
  using MakeDevice = std::function<std::shared_ptr<relight::gpu::Device>()>;

  /// Creates the first device if the plan's method needs one. Throws gpu::GpuError, InputError.
  LiveRelighter(const capture::Session& session, const relight::Plan& plan, MakeDevice make_device);

  struct Result {
    relight::RelitPicture picture;
    bool up_to_date = true;  ///< false: the scene has surfaces that are not prepared yet
  };
  /// Whether the renderer needs `prepare`; RayRenderer does.
  bool draws_prepared() const { return rays_ != nullptr; }
  /// Whether the scene contains surfaces that are not prepared. Any thread.
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
  void make();

  capture::Session session_;
  relight::Plan plan_;
  MakeDevice make_device_;
  std::shared_ptr<relight::UploadModels> upload_models_;  ///< if the method renders on a device,
  std::shared_ptr<relight::RayModels> ray_models_;        ///< else
  std::unique_ptr<relight::Renderer> renderer_;
  relight::RayRenderer* rays_ = nullptr;  ///< the renderer, if it is one

  mutable std::mutex prepared_mutex_;
  std::shared_ptr<const relight::RayRoom> prepared_, drawn_with_;

  relight::ChangeFade fade_;
  std::string failure_;
  std::chrono::steady_clock::time_point next_try_{};
  std::chrono::seconds pause_{0};
};

}  // namespace lumigraft::server
