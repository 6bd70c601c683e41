#pragma once
// The live clock: the only place with threads. Stages are functions; here each gets a thread, and mailboxes of one item
// join them, so the picture never waits for what is slower than it.
//
//   capture ──> pose ──> relight ──> encode ──> publish
//      │          ├─> geometry: fuse ──┐    (what geometry, light and albedo find meets relight in the SceneStore)
//      │          └─> lamp tags ─┐     ├─> albedo ─> room   (for rays alone: what they meet of the room)
//   fish-eye ─────────────> light ─────┘
//
// The stages from frames to the scene are SceneBuilder's, the same that a replay runs. Pose registers depth, and takes
// the newest frame just in time for relight to come free: poses that nobody draws are not found. The fish-eye goes to
// light by itself, so light goes on while drawing is slow and while the colour camera is away; of a recording, capture
// hands it on. Geometry, lamp tags, light, albedo and room run behind, with lower priority and rests, so that on two
// cores the picture comes first.
#include <Eigen/Geometry>
#include <chrono>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "capture/source.h"
#include "capture/sync/fisheye_reader.h"
#include "server/metrics/metrics.h"
#include "server/pipeline/exhibit_state.h"
#include "server/pipeline/live_relighter.h"
#include "server/pipeline/playback.h"
#include "server/pipeline/service_config.h"
#include "server/stream/encode_stage.h"
#include "server/stream/encoder_demand.h"

namespace lumigraft::server {

class Pipeline {
 public:
  struct Cameras {
    std::unique_ptr<capture::FrameReader> frames;
    std::unique_ptr<capture::FisheyeReader> fisheye;  ///< null where there is none, or the frames hold its pictures
  };
  using OpenCameras = std::function<Cameras()>;
  using Publish = std::function<void(std::shared_ptr<const StreamMessage>)>;

  /// Makes every stage and the GPU device; throws what they throw. `publish` is called on the encode thread.
  /// `open_again` is called when a recording gives nothing any more; `cameras` is what it gave first.
  Pipeline(ServiceInput input, Cameras cameras, OpenCameras open_again, LiveRelighter::MakeDevice make_device,
           EncoderDemand& demand, Metrics& metrics, Publish publish);
  ~Pipeline();  ///< stops and joins

  void start();
  /// Tells every thread to stop, and does not wait for it.
  void stop();
  /// Waits until every thread has stopped, however long a stage takes. After it nothing is published.
  void join();

  ExhibitState& exhibit();
  /// Where a recording plays; without effect on live cameras.
  Playback& playback();
  /// The newest picture; its srgb is null before the first.
  ShownPicture newest() const;
  /// What belongs to the newest picture.
  struct Record {
    std::vector<std::string> warnings;
    std::optional<Eigen::Isometry3d> T_tag_camera;
    relight::Plan plan;
    bool learning = true;  ///< albedo was not solved yet, or from far less of the room or other light than known now
    bool settled = false;  ///< nothing is left to learn: see SceneStore
    std::uint64_t field_version = 0, light_version = 0, albedo_version = 0;  ///< 0: not known yet
  };
  Record newest_record() const;

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace lumigraft::server
