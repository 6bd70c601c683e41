#pragma once
// Builds the scene from frames: runs the stages of reconstruct in the order of their dependences and combines their
// results in a store. Live and offline run the same builder; only the clock and the dropping of frames differ.
//
//   frame ──> register_depth ──> locate_camera ──> locate_lamp_tags ─┐
//                                      │                             v
//                                      │             fish-eye ──> extract_light ───────────────────┐
//                                      └──> complete_depth ──> estimate_color_gain ──> fuse_depth ─┴─> solve_albedo
//
// Offline, `build` runs them one after another on the caller's thread: nothing is dropped, and the same frames give the
// same scene on every run. A live pipeline runs each on a thread of its own, with its newest input.
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "reconstruct/albedo_schedule.h"
#include "reconstruct/exposure/color_gain.h"
#include "reconstruct/fusion/fusion.h"
#include "reconstruct/kept_room/kept_room.h"
#include "reconstruct/scene.h"
#include "reconstruct/scene_store.h"
#include "reconstruct/stage_cost.h"

namespace lumigraft::reconstruct {

/// Parts of the scene that are given instead of estimated, such as the truth of a synthetic session. A part with an
/// empty function is estimated. Exceptions become warnings of the frame, like those of stages.
struct SceneOverrides {
  std::function<capture::FrameSet(const capture::FrameSet&)> frame;  ///< may replace the sensor's depth
  std::function<Pose(const capture::FrameSet&)> pose;
  std::function<std::shared_ptr<const Illumination>(const capture::FrameSet&)> light;
  std::function<std::shared_ptr<const Enclosure>(const Illumination&)> enclosure;  ///< null: estimated
  std::function<std::shared_ptr<const AlbedoField>(const capture::FrameSet&, const Pose&, const DistanceField&)> albedo;
};

struct BuildResult {
  capture::FrameSet frame;  ///< with registered or completed depth, after SceneOverrides::frame
  Scene scene;
  std::map<std::string, StageCost> stages;
  std::vector<std::string> warnings;  ///< of all stages, in the order in which they ran
};

/// A room that is worth keeping.
struct RoomToKeep {
  KeptRoom room;
  bool another = false;  ///< than the one that was restored, which must not be replaced
};

class SceneBuilder {
 public:
  /// Throws InputError.
  explicit SceneBuilder(const capture::Session& session, SceneOverrides overrides = {},
                        std::unique_ptr<AlbedoPace> albedo_pace = std::make_unique<FramePace>(),
                        const FusionSettings& fusion = {});
  ~SceneBuilder();

  /// Runs all stages in order. An exception of a stage becomes a warning of the frame.
  BuildResult build(const capture::FrameSet& sensed);

  // The single stages. Each is for one thread at a time; different ones may run at the same time. Their results and
  // warnings are published in the store.

  /// See RegistrationStage. Poses of camera and lamps take the frames that this returns: with measured depth alone.
  capture::FrameSet register_depth(const capture::FrameSet& sensed);
  PoseStage::Result locate_camera(const capture::FrameSet& frame);
  /// Call when time goes back: the next pose is not predicted from the previous one. The reconstructed room is kept.
  void restart_tracking();
  /// Call before the first frame: where the tags are, as learnt before.
  void restore_tag_map(TagMap::State learnt);
  /// Call before the first frame: views of the room, as kept before.
  void restore_views(KeyframeMap::Views views);
  /// The kept views of the room, if there are new ones since the last call. Any thread.
  std::optional<KeyframeMap::Views> take_views();
  /// Call before the first frame: the room, as kept before. It is used from the first frame on whose depth agrees with
  /// it (RoomCheck); a warning says if it is another room.
  void restore_room(KeptRoom kept);
  /// The room, if it changed since the last call. Empty while it is not certain whether it is the one that was
  /// restored. One thread at a time, any.
  std::optional<RoomToKeep> room_to_keep();
  /// Where the tags are, if more was learnt since the last call. Any thread.
  std::optional<TagMap::State> take_tag_map();
  /// Poses of lamps that carry tags, for the light that is extracted next.
  LampTagStage::Result locate_lamp_tags(const capture::FrameSet& frame, const std::optional<Pose>& pose);
  /// `fisheye`: one frame, or the exposures of one bracket; empty if none is new: then lamps are only moved to their
  /// newest tag poses. `color`: of about the same time; may be null.
  void extract_light(const capture::FisheyeFrames& fisheye, const capture::Frame* color);
  /// The frame with depth where the session measures none (TagPlanes): for the stages that follow and for relight.
  capture::FrameSet complete_depth(const capture::FrameSet& frame, const std::optional<Pose>& pose);
  /// Changes of the colour camera's exposure and white balance: FrameSet::color_gain of this frame.
  ColorGainStage::Result estimate_color_gain(const capture::FrameSet& frame, const std::optional<Pose>& pose);
  /// The frame must have depth. If its pose is not its own, which would blur the field, only the light is followed.
  void fuse_depth(const capture::FrameSet& frame, const Pose& pose);
  /// False if no solution was due.
  bool solve_albedo();

  /// Whether much of the room or its light is unknown, or changed since albedo was last solved. Any thread.
  bool learning() const;
  /// On the thread that fuses.
  FusionStage::Memory fusion_memory() const;
  /// Wait until the next solution of albedo, as a multiple of the usual one. On the thread that solves it.
  int albedo_patience() const;

  SceneStore& store();
  const SceneStore& store() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace lumigraft::reconstruct
