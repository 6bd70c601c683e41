#pragma once
// The service's state as JSON: for viewers and monitoring.
#include <optional>
#include <string>

#include "capture/session/session.h"
#include "server/commands/record_button.h"
#include "server/metrics/metrics.h"
#include "server/pipeline/exhibit_state.h"
#include "server/pipeline/pipeline.h"
#include "server/stream/listener.h"

namespace lumigraft::server {

std::string hello_text(const capture::Session& session, const ExhibitState& exhibit, Permissions permissions);
std::string state_text(const ExhibitState& exhibit);
/// `recording` is empty where recording from the page is disabled, `playback` for live cameras.
std::string stats_text(const Pipeline::Record& record, const Metrics& metrics, const Metrics::Interval& interval,
                       const std::optional<RecordButton::State>& recording,
                       const std::optional<Playback::State>& playback);

/// Of the page /watch.html: `whep` is where it gets the published stream, null if that is nowhere.
std::string watch_text(const std::string& whep_url);

/// Whether the service does its work. Ages in seconds, negative if there is none: of the newest picture, of the newest
/// pose that was looked for, and since the service last rested (Metrics). A service that rests makes a picture only now
/// and then, but looks for the pose of its camera's frames.
bool is_healthy(double picture_age_s, double pose_age_s, double since_rest_s);

/// `ok` is is_healthy; `resting` is true while pictures are far apart because nobody watches; `grafting` is false where
/// for a minute none had the objects that should be shown.
struct Health {
  bool ok = false;
  std::string json;
};
Health health(const Metrics& metrics);

}  // namespace lumigraft::server
