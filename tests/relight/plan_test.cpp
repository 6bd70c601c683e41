#include "relight/plan.h"

#include <gtest/gtest.h>

#include "capture/error.h"

namespace lumigraft::relight {
namespace {

Plan plan_of(const std::string& toml, const Plan& defaults = {}) {
  const capture::ConfigTable root = capture::ConfigTable::parse(toml, "session.toml");
  const Plan plan = read_plan(root, defaults);
  root.finish();
  return plan;
}

std::string error_of(const std::string& toml) {
  try {
    plan_of(toml);
  } catch (const capture::InputError& error) {
    return error.what();
  }
  return "";
}

TEST(Plan, ReadsWhatIsGivenOverTheDefaults) {
  Plan defaults;
  defaults.volume = 64;
  defaults.bounces = 1;
  const Plan plan = plan_of(
      "[plan]\nmethod = \"dvct\"\ntrace_scale = 2\ncells = 1\nrsm = 512\nmax_lights = 0\nbounces = 3\n", defaults);
  EXPECT_EQ(plan.method, "dvct");
  EXPECT_EQ(plan.volume, 64);
  EXPECT_EQ(plan.trace_scale, 2);
  EXPECT_TRUE(plan.in_cells());
  EXPECT_EQ(plan.rsm, 512);
  EXPECT_EQ(plan.max_lights, 0);
  EXPECT_EQ(plan.bounces, 3);
  EXPECT_EQ(plan_of("", defaults).volume, 64);
}

TEST(Plan, LookIsThatOfTheCameraOrPlain) {
  EXPECT_EQ(plan_of("").look, "plain");
  const Plan plan = plan_of("[plan]\nlook = \"camera\"\n");
  EXPECT_EQ(plan.look, "camera");
  EXPECT_TRUE(plan.user_set.contains("look"));
  EXPECT_NE(error_of("[plan]\nlook = \"film\"\n").find("allowed: \"camera\", \"plain\""), std::string::npos)
      << error_of("[plan]\nlook = \"film\"\n");
}

TEST(Plan, OverridesFromTheCommandLine) {
  const capture::ConfigTable root =
      capture::ConfigTable::parse("", "session.toml", {"plan.volume=32", "plan.method=dvct"});
  EXPECT_EQ(read_plan(root, {}).volume, 32);
  root.finish();
}

TEST(Plan, ReadsAFormerNameWithAWarning) {
  const auto read = [](const char* line) {
    const capture::ConfigTable root = capture::ConfigTable::parse(std::string("[plan]\n") + line, "session.toml");
    const Plan plan = read_plan(root, {});
    root.finish();
    EXPECT_EQ(plan.adaptive, 0) << line;
    EXPECT_TRUE(plan.user_set.contains("adaptive")) << line;
    return root.warnings();
  };
  EXPECT_TRUE(read("adaptive = 0").empty());
  EXPECT_EQ(read("follow_scene = 0"),
            std::vector<std::string>{"session.toml:2: plan.follow_scene: is now named adaptive"});
  EXPECT_NE(error_of("[plan]\nfollow_scene = 0\nadaptive = 0").find("plan.follow_scene: found it together with"),
            std::string::npos);
  EXPECT_NE(error_of("[plan]\nfollow_scene = 2").find("session.toml:2: plan.follow_scene: found 2"), std::string::npos);
}

TEST(Plan, RefusesWhatIsNotAllowed) {
  struct Case {
    const char *toml, *where, *allowed;
  };
  for (const Case& c : {
           Case{"[plan]\nmethod = \"vct\"", "session.toml:2: plan.method: ", "\"dvct\""},
           Case{"[plan]\nlpv_steps = 3", "session.toml:2: plan.lpv_steps: found 3", "4 to 128"},
           Case{"[plan]\nvolume = 48", "session.toml:2: plan.volume: found 48", "32, 64, 128 or 256"},
           Case{"[plan]\nvolume = 512", "session.toml:2: plan.volume: found 512", "32"},
           Case{"[plan]\ntrace_scale = 8", "session.toml:2: plan.trace_scale: found trace_scale 8 with method \"dvct\"",
                "8 or 16 with \"rays\""},
           Case{"[plan]\ntrace_scale = 3", "session.toml:2: plan.trace_scale: found 3", "1, 2, 4, 8 or 16"},
           Case{"[plan]\nrsm = 300", "session.toml:2: plan.rsm: found 300", "64, 128, 256, 512 or 1024"},
           Case{"[plan]\nmax_lights = 33", "session.toml:2: plan.max_lights: found 33", "0 to 32"},
           Case{"[plan]\nbounces = 0", "session.toml:2: plan.bounces: found 0", "1 to 4"},
           Case{"[plan]\nbounces = 1.5", "session.toml:2: plan.bounces: found 1.5", "1 to 4"},
           Case{"[plan]\nsamples = 0", "session.toml:2: plan.samples: found 0", "1 to 65536"},
           Case{"[plan]\nvolumes = 64", "session.toml:2: plan.volumes: ", "volume"},
           Case{"plan = 3", "session.toml:1: plan: found 3", "table"},
       }) {
    const std::string message = error_of(c.toml);
    EXPECT_TRUE(message.starts_with(c.where)) << c.toml << " -> " << message;
    EXPECT_NE(message.find(c.allowed), std::string::npos) << message;
  }
}

TEST(Plan, HelpNamesEveryKeyOnce) {
  const std::vector<PlanKey> keys = plan_keys();
  ASSERT_EQ(keys.size(), 14u);
  EXPECT_EQ(keys[0].key, "plan.method");
  EXPECT_EQ(keys[1].key, "plan.look");
  EXPECT_EQ(keys[2].key, "plan.volume");
  EXPECT_EQ(keys[2].allowed, "32, 64, 128 or 256");
  for (const PlanKey& key : keys) EXPECT_FALSE(key.meaning.empty()) << key.key;
}

}  // namespace
}  // namespace lumigraft::relight
