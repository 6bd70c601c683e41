#include "relight/plan.h"

#include <algorithm>
#include <utility>

#include "capture/message_text.h"
#include "relight/shaders/common/interop.h"

namespace lumigraft::relight {
namespace {

struct IntegerKey {
  const char* key;
  int Plan::*value;
  std::vector<int> allowed;
  const char* meaning;
  const char* former = nullptr;  ///< former name of the key, still read
};

std::vector<int> from_to(int first, int last) {
  std::vector<int> values;
  for (int v = first; v <= last; ++v) values.push_back(v);
  return values;
}

const std::vector<IntegerKey>& integer_keys() {
  static const std::vector<IntegerKey> keys = {
      {"volume", &Plan::volume, {32, 64, 128, 256}, "voxels along the edge of each cascade"},
      {"trace_scale",
       &Plan::trace_scale,
       {1, 2, 4, 8, 16},
       "light is computed at 1/trace_scale of the image's resolution; 4: live, in cells; for rays only: 8 and 16: "
       "live, real surfaces too at a half or a quarter of it"},
      {"cells",
       &Plan::cells,
       {0, 1},
       "1: indirect light is gathered in cells, in rounds of frames while things move; 0: for pixels"},
      {"rsm", &Plan::rsm, {64, 128, 256, 512, 1024}, "edge of the reflective shadow maps, pixels"},
      {"max_lights", &Plan::max_lights, from_to(0, shader::kMaxLamps), "maximum number of lamps, strongest first"},
      {"sh_bands", &Plan::sh_bands, {1, 2, 3}, "bands of spherical harmonics of the environment"},
      {"bounces", &Plan::bounces, from_to(1, 4), "indirect bounces of the change"},
      {"lpv_steps", &Plan::lpv_steps, from_to(4, 128), "dlpv: steps of propagation"},
      {"rays", &Plan::rays, from_to(4, 4096), "rays: rays per gathering place or pixel"},
      {"samples", &Plan::samples, from_to(1, 65536), "reference: camera paths per pixel"},
      {"budget_ms", &Plan::budget_ms, from_to(0, 5000),
       "rays: milliseconds that a picture may take; trace_scale and rays follow, unless they are set; 0: any"},
      {"adaptive",
       &Plan::adaptive,
       {0, 1},
       "1: keys not set by the user are reduced to what the scene needs; 0: the plan is fixed",
       "follow_scene"},
  };
  return keys;
}

std::string text_of(const std::vector<int>& allowed) {
  const bool row = allowed.back() - allowed.front() + 1 == static_cast<int>(allowed.size()) && allowed.size() > 3;
  if (row) return std::to_string(allowed.front()) + " to " + std::to_string(allowed.back());
  std::string text;
  for (std::size_t i = 0; i < allowed.size(); ++i) {
    text += (i == 0 ? "" : i + 1 == allowed.size() ? " or " : ", ") + std::to_string(allowed[i]);
  }
  return text;
}

}  // namespace

Plan by_rays(Plan cones) {
  Plan plan = std::move(cones);
  plan.method = "rays";
  if (plan.trace_scale == 4 && !plan.user_set.contains("trace_scale")) plan.trace_scale = 8;
  return plan;
}

Plan read_plan(const capture::ConfigTable& root, const Plan& defaults) {
  Plan plan = defaults;
  const auto table = root.optional_table("plan");
  if (!table) return plan;
  plan.method = table->choice("method", plan_methods(), defaults.method);
  if (table->has("method")) plan.user_set.insert("method");
  plan.look = table->choice("look", plan_looks(), defaults.look);
  if (table->has("look")) plan.user_set.insert("look");
  for (const IntegerKey& key : integer_keys()) {
    const std::string_view name = key.former ? table->renamed(key.key, key.former) : key.key;
    if (!table->has(name)) continue;
    const int value = table->integer(name, key.allowed.front(), key.allowed.back());
    if (std::find(key.allowed.begin(), key.allowed.end(), value) == key.allowed.end()) {
      table->fail(name, "found " + std::to_string(value) + ", allowed: " + text_of(key.allowed));
    }
    plan.*key.value = value;
    plan.user_set.insert(key.key);
  }
  if (plan.trace_scale >= 8 && plan.method != "rays") {
    table->fail(table->has("trace_scale") ? "trace_scale" : "method",
                "found trace_scale " + std::to_string(plan.trace_scale) + " with method \"" + plan.method +
                    "\", allowed: 1, 2 or 4, and 8 or 16 with \"rays\"");
  }
  return plan;
}

std::vector<PlanKey> plan_keys() {
  std::vector<PlanKey> keys = {{"plan.method", capture::listed(plan_methods()), "rendering method"},
                               {"plan.look", capture::listed(plan_looks()),
                                "camera: noise and sharpness of the camera; plain: the exact change of light"}};
  for (const IntegerKey& key : integer_keys()) {
    keys.push_back({std::string("plan.") + key.key, text_of(key.allowed), key.meaning});
  }
  return keys;
}

std::vector<std::string> plan_looks() { return {"camera", "plain"}; }

std::vector<std::string> plan_methods() { return {"dvct", "dlpv", "rays", "reference"}; }

}  // namespace lumigraft::relight
