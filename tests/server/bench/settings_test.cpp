#include "server/bench/settings.h"

#include <gtest/gtest.h>

#include <set>
#include <string>

#include "server/pipeline/service_config.h"

namespace lumigraft::server {
namespace {

TEST(BenchSettings, EveryMethodHasSomeUnderNamesOfTheirOwn) {
  ASSERT_FALSE(relight::plan_methods().empty());
  for (const std::string& method : relight::plan_methods()) {
    std::set<std::string> names;
    for (const BenchSetting& setting : bench_settings(method)) {
      EXPECT_EQ(setting.plan.method, method);
      EXPECT_TRUE(names.insert(setting.name).second) << setting.name;
    }
    EXPECT_FALSE(names.empty()) << method;
  }
}

TEST(BenchSettings, WhatReplayAndServeDoIsAmongThem) {
  const auto trial = [](const std::string& method, const std::string& name) {
    for (const BenchSetting& setting : bench_settings(method)) {
      if (setting.name == name) {
        return setting.plan;
      }
    }
    relight::Plan none;
    none.method = "none";
    return none;
  };
  const auto expect_same = [](const relight::Plan& a, const relight::Plan& b) {
    EXPECT_EQ(a.volume, b.volume);
    EXPECT_EQ(a.trace_scale, b.trace_scale);
    EXPECT_EQ(a.rsm, b.rsm);
    EXPECT_EQ(a.bounces, b.bounces);
    EXPECT_EQ(a.method, b.method);
    EXPECT_EQ(a.rays, b.rays);
  };
  expect_same(trial("rays", "half-20-rays"), replay_plan());
  expect_same(trial("dvct", "half-64"), relight::Plan{});
  expect_same(trial("dvct", "live-64"), interactive_plan());
}

}  // namespace
}  // namespace lumigraft::server
