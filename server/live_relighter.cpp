#include "server/live_relighter.h"

#include <algorithm>
#include <utility>

#include "server/camera_picture.h"

namespace lumigraft {
namespace {

constexpr std::chrono::seconds kFirstPause{1}, kLongestPause{30};  // the first try comes with the next frame

}  // namespace

LiveRelighter::LiveRelighter(const Session& session, MakeDevice make_device)
    : session_(session), make_device_(std::move(make_device)) {
  make();
}

void LiveRelighter::make() { relighter_ = std::make_unique<Relighter>(make_device_(), session_); }

LiveRelighter::Result LiveRelighter::relight(const FrameSet& frame, const Scene& scene, const Exhibit& exhibit,
                                             const Plan& plan) {
  Result result;
  try {
    if (!relighter_ && std::chrono::steady_clock::now() >= next_try_) {
      make();
    }
    if (relighter_) {
      result.picture = relighter_->relight(frame, scene, exhibit, plan);
      pause_ = std::chrono::seconds(0);
      failure_.clear();
    }
  } catch (const gpu::GpuError& e) {
    relighter_.reset();  // frees the device before the next one is made
    next_try_ = std::chrono::steady_clock::now() + pause_;
    pause_ = std::clamp(2 * pause_, kFirstPause, kLongestPause);
    failure_ = std::string("the GPU failed and is made again: ") + e.what();
  } catch (const std::exception& e) {
    failure_ = std::string("relight: ") + e.what();
  }
  if (!failure_.empty()) {
    result.picture.warnings.push_back(failure_);
  }
  if (result.picture.srgb.empty()) {
    result.picture.srgb = camera_picture(*frame.color);
    result.picture.plan = plan;
    result.picture.passed_through = true;
  }
  result.passed_through = result.picture.passed_through;
  return result;
}

}  // namespace lumigraft
