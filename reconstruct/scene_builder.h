#pragma once
// From frames to the scene: the stages of reconstruct in the order that they depend on each other, with the store where
// their results meet. Live and offline run the same builder; only the clock and the dropping of frames differ.
//
//   frame ──> register_depth ──> locate_camera ──> locate_lamp_tags ─┐
//                                      │                             v
//                                      │             fish-eye ──> extract_light ─┐
//                                      └──> fuse_depth ──────────────────────────┴─> solve_albedo
//
// Offline, `build` runs them one after the other on the caller's thread: nothing is dropped, and the same frames give
// the same scene on every run. A live pipeline runs each on a thread of its own, with the newest input there is.
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "reconstruct/albedo_schedule.h"
#include "reconstruct/scene.h"
#include "reconstruct/scene_store.h"
#include "reconstruct/stage_cost.h"

namespace lumigraft::reconstruct {

/// Parts of the scene that somebody knows better than estimates do, as the truth of a made session. An empty function:
/// that part is estimated. What they throw becomes a warning of the frame, as what stages throw.
struct SceneOverrides {
  std::function<capture::FrameSet(const capture::FrameSet&)> frame;  ///< with other depth than the sensor's
  std::function<Pose(const capture::FrameSet&)> pose;
  std::function<std::shared_ptr<const Illumination>(const capture::FrameSet&)> light;
  std::function<std::shared_ptr<const Enclosure>(const Illumination&)> enclosure;  ///< null: estimated
  std::function<std::shared_ptr<const AlbedoField>(const capture::FrameSet&, const Pose&, const DistanceField&)> albedo;
};

struct BuildResult {
  capture::FrameSet frame;  ///< with depth registered, and what overrides put into it
  Scene scene;
  std::map<std::string, StageCost> stages;
  std::vector<std::string> warnings;  ///< of every stage, in the order they ran
};

class SceneBuilder {
 public:
  /// Throws what the stages throw of a session, InputError.
  explicit SceneBuilder(const capture::Session& session, SceneOverrides overrides = {},
                        std::unique_ptr<AlbedoPace> albedo_pace = std::make_unique<FramePace>());
  ~SceneBuilder();

  /// All stages, in order. A stage that throws becomes a warning of the frame.
  BuildResult build(const capture::FrameSet& sensed);

  // The stages by themselves. Each is for one thread at a time, different ones may run at once. What they find is
  // published in the store, with their warnings.

  /// See RegistrationStage; what follows wants its frames.
  capture::FrameSet register_depth(const capture::FrameSet& sensed);
  PoseStage::Result locate_camera(const capture::FrameSet& frame);
  /// Time went back: the pose does not follow from the one before. The room is the same, so all else stays.
  void restart_tracking();
  /// Where lamps stand that carry tags: for the light that is extracted next.
  LampTagStage::Result locate_lamp_tags(const capture::FrameSet& frame, const std::optional<Pose>& pose);
  /// `fisheye`: one picture, or the exposures of one bracket; none where no new one came: then lamps alone are placed
  /// by what is new of their tags. `color`: of about the same moment; may be null.
  void extract_light(const capture::FisheyePictures& fisheye, const capture::Picture* color);
  /// The frame has depth, and its pose is not one of the past, which would smear the field.
  void fuse_depth(const capture::FrameSet& frame, const Pose& pose);
  /// False where nothing was due.
  bool solve_albedo();

  /// Much of the room or its light is not known yet, or changed since albedo was last solved. Any thread.
  bool learning() const;
  /// Times the usual wait between two solutions of albedo. On the thread that solves it.
  int albedo_patience() const;

  SceneStore& store();
  const SceneStore& store() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace lumigraft::reconstruct
