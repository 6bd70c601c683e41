#include "server/commands/serve_texts.h"

#include <filesystem>
#include <nlohmann/json.hpp>

#include "server/commands/parameters.h"
#include "server/commands/viewer_text.h"
#include "server/metrics/version.h"
#include "server/pipeline/json_text.h"

namespace lumigraft::server {
namespace {

using Json = nlohmann::ordered_json;

Json recording_json(const RecordButton::State& state) {
  constexpr const char* kDoing[] = {"nothing", "starting", "recording", "finishing", "compressing"};
  return {{"doing", kDoing[static_cast<int>(state.doing)]},
          {"seconds", state.seconds},
          {"folder", std::filesystem::path(state.folder).filename().string()},  // viewers need no path of this machine
          {"pictures", state.frames},
          {"lost", state.lost},
          {"error", state.error}};
}

}  // namespace

std::string hello_text(const capture::Session& session, const ExhibitState& exhibit, Permissions permissions) {
  const capture::CameraModel& c = session.color.model;
  return json_line({{"type", "hello"},
                    {"protocol", kProtocolVersion},
                    {"program", version_line()},
                    {"session", session.name},
                    {"permissions", permissions.names()},
                    {"width", c.width},
                    {"height", c.height},
                    {"camera", {{"fx", c.fx}, {"fy", c.fy}, {"cx", c.cx}, {"cy", c.cy}}},
                    {"objects", Json::parse(exhibit.objects_json())}});
}

std::string state_text(const ExhibitState& exhibit) {
  return json_line({{"type", "state"}, {"objects", Json::parse(exhibit.objects_json())}});
}

std::string stats_text(const Pipeline::Record& record, const Metrics& metrics, const Metrics::Interval& interval,
                       const std::optional<RecordButton::State>& recording,
                       const std::optional<Playback::State>& playback) {
  Json warnings = Json::array();
  for (const std::string& warning : record.warnings) warnings.push_back(without_folders(warning));
  Json json{{"type", "stats"},
            {"fps", interval.seconds > 0 ? static_cast<double>(interval.frames) / interval.seconds : 0.0},
            {"frames", metrics.frames()},
            {"clients", metrics.viewers()},
            {"stage_ms", Json::object()},
            {"drops", Json::object()},
            {"plan", plan_json(record.plan)},
            {"T_tag_camera", record.T_tag_camera ? transform_json(*record.T_tag_camera) : Json()},
            {"scene",
             {{"learning", record.learning},
              {"settled", record.settled},
              {"field", record.field_version},
              {"light", record.light_version},
              {"albedo", record.albedo_version}}},
            {"warnings", warnings},
            {"recording", recording ? recording_json(*recording) : Json()},
            {"playback", Json()}};
  if (playback) {
    json["playback"] = {{"at_s", playback->at_s}, {"length_s", playback->length_s}, {"paused", playback->paused}};
  }
  for (const auto& [stage, s] : interval.stages) {
    json["stage_ms"][stage] = {{"mean", s.mean_ms}, {"p95", s.p95_ms}, {"max", s.max_ms}};
  }
  for (const auto& [stage, count] : metrics.drops()) json["drops"][stage] = count;
  return json_line(json);
}

std::string watch_text(const std::string& whep_url) {
  return json_line({{"whep", whep_url.empty() ? Json() : Json(whep_url)}});
}

bool is_healthy(double picture_age_s, double pose_age_s, double since_rest_s) {
  const auto recent = [](double age_s, double limit_s) { return age_s >= 0 && age_s < limit_s; };
  if (recent(picture_age_s, kCommands.stale_after_s)) return true;
  return recent(since_rest_s, kCommands.stale_after_s) && recent(pose_age_s, kCommands.stale_after_s) &&
         recent(picture_age_s, kCommands.resting_stale_after_s);
}

Health health(const Metrics& metrics) {
  Health health;
  const double age_s = metrics.age_of_last_frame_s(), pose_s = metrics.age_of_last_pose_s();
  health.ok = is_healthy(age_s, pose_s, metrics.since_rest_s());
  health.json = json_line({{"ok", health.ok},
                           {"frames", metrics.frames()},
                           {"grafting", metrics.not_grafted_s() < kCommands.not_grafting_after_s},
                           {"resting", metrics.rests()},
                           {"age_of_last_frame_s", age_s < 0 ? Json() : Json(age_s)},
                           {"age_of_last_pose_s", pose_s < 0 ? Json() : Json(pose_s)},
                           {"viewers", metrics.viewers()}}) +
                "\n";
  return health;
}

}  // namespace lumigraft::server
