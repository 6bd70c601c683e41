#pragma once
// Relight for a service that goes on: a device that fails is made again, and until it works the camera's picture passes
// through with a warning.
#include <chrono>
#include <functional>
#include <memory>

#include "relight/relighter.h"

namespace lumigraft {

class LiveRelighter {
 public:
  using MakeDevice = std::function<std::shared_ptr<gpu::Device>()>;

  /// Makes the first device. Throws gpu::GpuError.
  LiveRelighter(const Session& session, MakeDevice make_device);

  struct Result {
    RelitPicture picture;
    bool passed_through = false;  ///< nothing was grafted
  };
  /// Never throws.
  Result relight(const FrameSet& frame, const Scene& scene, const Exhibit& exhibit, const Plan& plan);

 private:
  void make();

  Session session_;
  MakeDevice make_device_;
  std::unique_ptr<Relighter> relighter_;
  std::string failure_;
  std::chrono::steady_clock::time_point next_try_{};
  std::chrono::seconds pause_{0};
};

}  // namespace lumigraft
