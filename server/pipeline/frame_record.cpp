#include "server/pipeline/frame_record.h"

#include <nlohmann/json.hpp>

#include "server/pipeline/json_text.h"

namespace lumigraft::server {
namespace {

using Json = nlohmann::ordered_json;

Json rgb(const Eigen::Vector3f& v) { return Json::array({v.x(), v.y(), v.z()}); }

Json lamp(const reconstruct::PointLight& light) {
  Json json{{"id", light.id},
            {"direction", rgb(light.direction)},
            {"irradiance", rgb(light.irradiance)},
            {"angular_radius_rad", light.angular_radius_rad},
            {"clipped", light.clipped},
            {"power_log_sigma", light.power_log_sigma}};
  if (light.distance_known) {
    json["position"] = rgb(light.position_m);
    json["intensity"] = rgb(light.intensity);
    json["radius_m"] = light.radius_m;
    json["distance_log_sigma"] = light.distance_log_sigma;
    if (light.flat) json["normal"] = rgb(light.normal);
  }
  return json;
}

}  // namespace

std::string frame_record_line(const capture::FrameSet& frame, const FrameRecord& record) {
  const reconstruct::Scene& scene = record.scene;
  Json json{{"index", frame.index}, {"time_s", 1e-9 * static_cast<double>(frame.time_ns)}};
  json["T_tag_camera"] = scene.pose ? transform_json(scene.pose->T_tag_camera) : Json();
  json["color_gain"] = record.color_gain;
  json["lights"] = Json::array();
  json["sh"] = Json();
  if (scene.illumination) {
    for (const reconstruct::PointLight& light : scene.illumination->lights) json["lights"].push_back(lamp(light));
    json["sh"] = Json::array();
    for (const Eigen::Vector3f& coefficient : scene.illumination->environment_sh) {
      json["sh"].push_back(rgb(coefficient));
    }
  }
  json["plan"] = plan_json(record.picture.plan);
  json["planned"] = Json::array();
  for (const relight::PlanChoice& choice : record.choices) {
    json["planned"].push_back(
        Json{{"key", choice.key}, {"most", choice.requested}, {"value", choice.value}, {"left_out", choice.left_out}});
  }
  json["stage_ms"] = Json::object();
  json["stage_cpu_ms"] = Json::object();
  for (const auto& [stage, cost] : record.stages) {
    json["stage_ms"][stage] = cost.wall_ms;
    json["stage_cpu_ms"][stage] = cost.cpu_ms;
  }
  json["pass_ms"] = Json::object();
  for (const relight::gpu::PassTime& pass : record.picture.passes) {
    json["pass_ms"][pass.name] = json["pass_ms"].value(pass.name, 0.0) + pass.gpu_ms;
  }
  json["warnings"] = record.warnings;
  return json_line(json);
}

std::string skipped_frame_line(std::uint64_t index, const std::vector<std::string>& warnings) {
  return json_line(Json{{"index", index},
                        {"skipped", true},
                        {"time_s", Json()},
                        {"T_tag_camera", Json()},
                        {"color_gain", Json()},
                        {"lights", Json::array()},
                        {"sh", Json()},
                        {"plan", Json()},
                        {"planned", Json::array()},
                        {"stage_ms", Json::object()},
                        {"stage_cpu_ms", Json::object()},
                        {"pass_ms", Json::object()},
                        {"warnings", warnings}});
}

}  // namespace lumigraft::server
