#include "relight/plan.h"

#include <algorithm>
#include <string_view>

#include "relight/shaders/common/interop.h"

namespace lumigraft::relight {
namespace {

struct IntegerKey {
  const char* key;
  int Plan::*value;
  std::vector<int> allowed;
  const char* meaning;
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
       {1, 2, 4, 8},
       "light is traced at 1/trace_scale of the picture; 4: live, in cells; 8: live by rays"},
      {"cells",
       &Plan::cells,
       {0, 1},
       "1: indirect light is gathered in cells, in rounds of frames while things move; 0: for pixels"},
      {"rsm", &Plan::rsm, {64, 128, 256, 512, 1024}, "edge of the reflective shadow maps, pixels"},
      {"max_lights", &Plan::max_lights, from_to(0, shader::kMaxLamps), "strongest lamps that are drawn as lamps"},
      {"sh_bands", &Plan::sh_bands, {1, 2, 3}, "bands of harmonics of all light but the lamps"},
      {"bounces", &Plan::bounces, from_to(1, 4), "indirect bounces of the change"},
      {"lpv_steps", &Plan::lpv_steps, from_to(4, 128), "dlpv: steps of propagation"},
      {"rays", &Plan::rays, from_to(4, 4096), "rays of a place or pixel; of method rays alone"},
      {"samples", &Plan::samples, from_to(1, 65536), "camera paths a pixel; of method reference alone"},
      {"follow_scene",
       &Plan::adaptive,
       {0, 1},
       "1: what is not set by hand is only as much as the scene needs; 0: it stays as it is"},
  };
  return keys;
}

const std::vector<std::string>& methods() {
  static const std::vector<std::string> words = {"dvct", "dlpv", "rays", "reference"};
  return words;
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

Plan read_plan(const capture::ConfigTable& root, const Plan& defaults) {
  Plan plan = defaults;
  const auto table = root.optional_table("plan");
  if (!table) return plan;
  plan.method = table->choice("method", methods(), defaults.method);
  for (const IntegerKey& key : integer_keys()) {
    if (!table->has(key.key)) continue;
    const int value = table->integer(key.key, key.allowed.front(), key.allowed.back());
    if (std::find(key.allowed.begin(), key.allowed.end(), value) == key.allowed.end()) {
      table->fail(key.key, "found " + std::to_string(value) + ", allowed: " + text_of(key.allowed));
    }
    plan.*key.value = value;
    plan.user_set.insert(key.key);
  }
  if (plan.trace_scale == 8 && plan.method != "rays") {
    table->fail(table->has("trace_scale") ? "trace_scale" : "method",
                "found trace_scale 8 with method \"" + plan.method + "\", allowed: 1, 2 or 4, and 8 with \"rays\"");
  }
  return plan;
}

std::vector<PlanKey> plan_keys() {
  std::string words;
  for (const std::string& method : methods()) words += (words.empty() ? "" : ", ") + method;
  std::vector<PlanKey> keys = {{"plan.method", words, "how light is carried"}};
  for (const IntegerKey& key : integer_keys()) {
    keys.push_back({std::string("plan.") + key.key, text_of(key.allowed), key.meaning});
  }
  return keys;
}

std::vector<std::string> plan_methods() { return methods(); }

}  // namespace lumigraft::relight
