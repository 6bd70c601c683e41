#pragma once
// Configuration of a service, from files and the command line.
#include <cstdint>
#include <filesystem>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "capture/session/session.h"
#include "reconstruct/fusion/parameters.h"
#include "reconstruct/kept_room/kept_room.h"
#include "reconstruct/pose/keyframe_map.h"
#include "reconstruct/pose/tag_map.h"
#include "relight/exhibit/loading.h"
#include "relight/gpu/device.h"
#include "relight/plan.h"
#include "server/pipeline/exhibit_state.h"
#include "server/publish/publish_url.h"
#include "server/publish/watch_url.h"
#include "server/stream/listener.h"
#include "server/stream/network_rate.h"

namespace lumigraft::server {

/// What recordings from the page may take of the disk.
struct RecordingLimits {
  double max_s = 600;        ///< a recording ends after so long
  double max_total_gb = 50;  ///< of all recordings together; the oldest go
  double min_free_gb = 5;    ///< left to others on the disk; the oldest recordings go
};

struct ServerSettings {
  std::vector<ListenerSettings> listeners;
  int max_viewers = 64;  ///< of all listeners together
  int jpeg_quality = 85;
  RateLimits rate;                   ///< of H.264
  std::filesystem::path recordings;  ///< folder for recordings from the page; empty: it cannot record
  RecordingLimits recording_limits;
  double max_upload_mb = 256;                                   ///< of a model that is uploaded
  std::optional<PublishUrl> publish;                            ///< a media server to publish to
  WatchUrl watch;                                               ///< where /watch.html gets what is published
  relight::gpu::Backend backend = relight::gpu::Backend::best;  ///< also for replay
  reconstruct::FusionSettings fusion;                           ///< also for replay
  std::filesystem::path room;  ///< file of the kept room, also for replay; empty: the default of live cameras
};

struct ServiceFiles {
  std::filesystem::path config;   ///< empty: the session's own session.toml
  std::filesystem::path session;  ///< a folder; empty: from the configuration
  std::filesystem::path exhibit;  ///< empty: that of the configuration, else the session's exhibit.toml if it exists
  std::vector<std::string> overrides;  ///< KEY=VALUE
  bool with_saved = false;             ///< the exhibit as an operator saved it (saved_exhibit.h)
};

struct ServiceInput {
  capture::Session session;
  capture::SessionText session_text;  ///< text that `session` was read from
  relight::Exhibit exhibit;
  std::vector<relight::UnloadedObject>
      unloaded;  ///< of `exhibit`, objects whose models are to be loaded by the service
  ExhibitLimits limits;
  relight::Plan plan;
  ServerSettings server;
  std::filesystem::path exhibit_file;                 ///< empty: there is none
  std::optional<reconstruct::TagMap::State> tag_map;  ///< learnt earlier; see TagMapFile
  reconstruct::KeyframeMap::Views views;              ///< kept earlier; see ViewsFile
  std::optional<reconstruct::KeptRoom> room;          ///< kept earlier; see KeptRoomFile
  std::vector<std::string> warnings;                  ///< about former and obsolete keys in these files
};

/// A configuration defines cameras like a session.toml, or names a recorded session: session = "FOLDER"; `--set` then
/// also sets keys of that session.toml. Optional in both cases: exhibit = "FILE", [plan], [server]. Throws InputError.
/// Objects whose model file is larger than `max_model_bytes` are left without models.
ServiceInput read_service(const ServiceFiles& files, const relight::Plan& default_plan,
                          std::uintmax_t max_model_bytes = std::numeric_limits<std::uintmax_t>::max());

/// The text of `--set help`.
std::string settable_keys();

/// Defaults of replay: accuracy first. Defaults of serve: fast enough for two cores.
relight::Plan replay_plan();
relight::Plan interactive_plan();

}  // namespace lumigraft::server
