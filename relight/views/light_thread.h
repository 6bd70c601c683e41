#pragma once
// Finds light for views on a thread of its own.
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <exception>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <vector>

#include "relight/quality_ladder.h"
#include "relight/view_motion.h"
#include "relight/views/view_lighting.h"

namespace lumigraft::relight {

/// What light is found for.
struct LightRequest {
  capture::FrameSet frame;
  reconstruct::Scene scene;
  Exhibit exhibit;
  Plan plan;
  Eigen::Isometry3f T_tag_camera = Eigen::Isometry3f::Identity();
  std::shared_ptr<const RayRoom> room;
};

struct FoundLight {
  std::uint64_t number = 0;                         ///< of the last request that was answered; 0: none
  std::shared_ptr<const ViewLight> light;           ///< null: every object's model is yet to be prepared
  std::int64_t frame_index = -1;                    ///< for which it was found
  std::vector<std::shared_ptr<const Model>> asked;  ///< models of the exhibit's objects that are drawn at that time,
  std::vector<bool> drawn;                          ///< and which of them are prepared
  std::vector<std::string> preparing;               ///< names of the others
  Plan plan;                                        ///< its settings
  std::vector<gpu::PassTime> passes;                ///< of the last request
  double took_ms = 0;                               ///< likewise
  std::chrono::steady_clock::time_point ended;      ///< likewise
  std::exception_ptr failure;                       ///< likewise; then light is that of an earlier one
};

class LightThread {
 public:
  LightThread(const capture::Session& session, std::shared_ptr<const RayModels> models);

  /// The number of the request, if the thread is idle; else empty, and the request is left out.
  std::optional<std::uint64_t> ask(LightRequest request);
  /// Waits until this request, or the one at work, was answered.
  void wait(std::uint64_t number) const;
  void wait_idle() const;
  /// At most so long.
  void wait_for(std::uint64_t number, double ms) const;
  FoundLight newest() const;

  std::shared_ptr<const RayRoom> room_of(const reconstruct::Scene& scene) const { return lighting_.room_of(scene); }

 private:
  void run(const std::stop_token& stop);
  void answer(const LightRequest& request, FoundLight* found);

  // Of the thread alone.
  ViewLighting lighting_;
  std::shared_ptr<const RayRoom> entered_;
  CameraUpload camera_;
  ViewMotion view_motion_;
  QualityLadder ladder_;

  mutable std::mutex mutex_;  ///< guards all below
  mutable std::condition_variable_any changed_;
  std::optional<LightRequest> request_;
  bool at_work_ = false;
  std::uint64_t asked_ = 0;
  FoundLight newest_;
  std::jthread thread_;
};

}  // namespace lumigraft::relight
