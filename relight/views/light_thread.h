#pragma once
// Finds light for views on a thread of its own.
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <exception>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
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

/// An object of the exhibit, wherever it is.
struct DrawnObject {
  std::string name;
  std::shared_ptr<const Model> model;

  bool operator==(const DrawnObject&) const = default;
};
/// Those that are drawn at this time, in the order of reference_objects_of.
std::vector<DrawnObject> drawn_objects(const Exhibit& exhibit, double time_s);

/// The answer to the last request.
struct FoundLight {
  std::uint64_t number = 0;                ///< of the request; 0: none was answered
  std::shared_ptr<const ViewLight> light;  ///< null: every object's model is yet to be prepared
  std::int64_t frame_index = -1;           ///< for which it was found
  std::vector<DrawnObject> asked;          ///< of the exhibit,
  std::vector<bool> drawn;                 ///< and which of them are prepared
  std::vector<std::string> preparing;      ///< names of the others
  Plan plan;                               ///< its settings
  std::vector<gpu::PassTime> passes;       ///< that were computed for it
  double took_ms = 0;
  std::chrono::steady_clock::time_point ended;
  bool changes = false;  ///< more light would be found for the same view, object and room
  std::shared_ptr<const reconstruct::LampShadows> shadows;  ///< Scene::shadows
  std::exception_ptr failure;  ///< if it failed; then all but number, passes and ended is of the request before
};

class LightThread {
 public:
  LightThread(const capture::Session& session, std::shared_ptr<const RayModels> models);

  /// The number of the request, if the thread is idle; else empty, and the request is left out.
  std::optional<std::uint64_t> ask(LightRequest request);
  /// Waits until this request was answered.
  void wait(std::uint64_t number) const;
  void wait_idle() const;
  /// At most so long.
  void wait_for(std::uint64_t number, double ms) const;
  FoundLight newest() const;
  /// Whether the thread has been at one request for so long that it may never answer.
  bool hangs() const;

  std::shared_ptr<const RayRoom> room_of(const reconstruct::Scene& scene) const {
    return std::make_shared<const RayRoom>(scene, known_, session_.tag);
  }

 private:
  void run(const std::stop_token& stop);
  void answer(const LightRequest& request, FoundLight* found);

  const capture::Session session_;
  const std::shared_ptr<const RayModels> models_;
  const std::vector<KnownSurface> known_;

  // Of the thread alone.
  std::optional<ViewLighting> lighting_;  ///< made anew after a failure, which may have left it between two states
  std::shared_ptr<const RayRoom> entered_;
  CameraUpload camera_;
  ViewMotion view_motion_;
  QualityLadder ladder_;

  mutable std::mutex mutex_;  ///< guards all below
  mutable std::condition_variable_any changed_;
  std::optional<LightRequest> request_;
  bool at_work_ = false;
  std::uint64_t asked_ = 0;
  std::chrono::steady_clock::time_point asked_at_;
  FoundLight newest_;
  std::jthread thread_;
};

}  // namespace lumigraft::relight
