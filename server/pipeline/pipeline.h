#pragma once
// The live pipeline, the only place with threads. Stages are functions; here each has a thread, and mailboxes of one
// item connect them, so rendering never waits for slower stages.
//
//   capture ──> pose ──> relight ──> encode ──> publish
//      │          ├─> geometry: fuse ──┐    (relight reads the results of geometry, light and albedo in the SceneStore)
//      │          └─> lamp tags ─┐     ├─> albedo ─> room   (for `rays` only: the geometry that is ray traced)
//   fish-eye ─────────────> light ─────┘
//   exhibit ──> models   (what rendering needs once per model)
//   geometry, albedo ──> keep room   (the disk, minutes apart)
//   relight ──> maps    (pictures of the reconstructed scene, on request)
//
// The stages from frames to the scene are SceneBuilder's, which replay runs too. Pose registers depth, and takes the
// newest frame just in time for relight, so that no pose is computed for frames that are not rendered. A live fish-eye
// has a thread of its own, so light is updated while rendering is slow or the colour camera is disconnected; of a
// recording, capture passes its frames to light. Geometry, lamp tags, light, albedo and room have lower
// priority and rest between turns, models and keep room have lower priority, so that on two cores rendering comes
// first. While nobody watches, all of them rest for most of the time (audience.h).
#include <Eigen/Geometry>
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "capture/source.h"
#include "capture/sync/fisheye_reader.h"
#include "reconstruct/scene_builder.h"
#include "server/maps/map_board.h"
#include "server/metrics/metrics.h"
#include "server/pipeline/exhibit_state.h"
#include "server/pipeline/live_relighter.h"
#include "server/pipeline/playback.h"
#include "server/pipeline/room_keeper.h"
#include "server/pipeline/service_config.h"
#include "server/stream/encode_stage.h"

namespace lumigraft::server {

class Pipeline {
 public:
  struct Cameras {
    std::unique_ptr<capture::FrameReader> frames;
    std::unique_ptr<capture::FisheyeReader> fisheye;  ///< null if there is none, or if `frames` contain its images
  };
  using OpenCameras = std::function<Cameras()>;
  /// Keeps the room for the next start; returns the size of the file. Called on a thread of its own, and by keep_room.
  using Keep = RoomKeeper::Keep;
  using Publish = std::function<void(std::shared_ptr<const StreamMessage>)>;

  /// Creates all stages and the GPU device; throws what they throw. `publish` is called on the encode thread.
  /// `keep` may be empty.
  /// `open_again` is called when a recording gives no frames any more; `cameras` is the result of its first call.
  Pipeline(ServiceInput input, Cameras cameras, OpenCameras open_again, LiveRelighter::MakeDevice make_device,
           EncoderDemand& demand, Metrics& metrics, Publish publish, Keep keep = {});
  ~Pipeline();  ///< stops and joins

  void start();
  /// Requests all threads to stop, without waiting.
  void stop();
  /// Waits until all threads have stopped, however long a stage takes. Afterwards nothing is published.
  void join();

  ExhibitState& exhibit();
  /// ExhibitState::apply, with `on_pixel` of the newest picture. Returns the error, if any. Any thread.
  std::optional<std::string> change_object(ObjectCommand command);
  /// Shows another exhibit, all of whose models are loaded, once its models are prepared; until then the one before.
  /// Any thread.
  void replace_exhibit(relight::Exhibit exhibit, ExhibitLimits limits);
  /// Playback of a recording; without effect on live cameras.
  Playback& playback();
  /// Where the tags are, if more was learnt since the last call.
  std::optional<reconstruct::TagMap::State> take_tag_map();
  /// The kept views of the room, if there are new ones since the last call.
  std::optional<reconstruct::KeyframeMap::Views> take_views();
  /// Keeps the room now, if it changed since it was last kept. Any thread; waits while it is being kept.
  void keep_room();
  /// The thread that has completed no iteration for so long, if there is one (heartbeats.h), or a GPU that hung too
  /// often.
  std::optional<std::string> hung(std::chrono::steady_clock::duration limit) const;
  /// Somebody uses newest(): pictures are made as for a viewer for a while. Any thread.
  void picture_asked();
  /// The newest image; its srgb is null before the first. Up to half a minute old where nobody watched.
  ShownFrame newest() const;
  /// The newest map; requests further ones for some seconds. Empty: none is drawn yet, or what it shows is not known.
  /// Any thread.
  std::optional<MapPicture> map(MapKind kind);
  /// The record of the newest image.
  struct Record {
    std::vector<std::string> warnings;
    std::optional<Eigen::Isometry3d> T_tag_camera;  ///< in the frame in which the exhibit is placed
    relight::Plan plan;
    bool learning = true;  ///< albedo is unsolved, or was solved for much less of the room or for other light
    bool settled = false;  ///< see SceneStore::settled
    std::uint64_t field_version = 0, light_version = 0, albedo_version = 0;  ///< 0: unknown
  };
  Record newest_record() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace lumigraft::server
