#include "server/metrics/metrics.h"

#include <gtest/gtest.h>

#include <chrono>
#include <thread>

#include "server/commands/serve_log.h"

namespace lumigraft::server {
namespace {

TEST(Metrics, HistogramsAreCumulative) {
  Metrics metrics;
  metrics.time("pose", 0.0015);
  metrics.time("pose", 0.004);
  metrics.time("pose", 60);
  metrics.drop("fuse", 3);
  metrics.frame_made();
  metrics.encoded("jpeg", 1000);
  metrics.cameras_with_faults(1);
  metrics.fused(7, 86016, 2);
  metrics.kept(4096);
  const std::string text = metrics.prometheus();
  for (const char* line :
       {"lumigraft_stage_seconds_bucket{stage=\"pose\",le=\"0.001\"} 0\n",
        "lumigraft_stage_seconds_bucket{stage=\"pose\",le=\"0.002\"} 1\n",
        "lumigraft_stage_seconds_bucket{stage=\"pose\",le=\"0.005\"} 2\n",
        "lumigraft_stage_seconds_bucket{stage=\"pose\",le=\"+Inf\"} 3\n",
        "lumigraft_stage_seconds_count{stage=\"pose\"} 3\n", "lumigraft_dropped_total{stage=\"fuse\"} 3\n",
        "lumigraft_cameras_in_trouble 1\n", "lumigraft_fusion_bricks 7\n", "lumigraft_fusion_bytes 86016\n",
        "lumigraft_fusion_evicted_bricks_total 2\n", "lumigraft_kept_room_bytes 4096\n", "lumigraft_frames_total 1\n",
        "lumigraft_encoded_bytes_total{codec=\"jpeg\"} 1000\n"}) {
    EXPECT_NE(text.find(line), std::string::npos) << line << text;
  }
}

TEST(Metrics, KnowsSinceWhenNothingIsGrafted) {
  Metrics metrics;
  std::this_thread::sleep_for(std::chrono::milliseconds(30));
  metrics.frame_made(false);
  EXPECT_GE(metrics.not_grafted_s(), 0.03);
  EXPECT_LT(metrics.age_of_last_frame_s(), metrics.not_grafted_s());
  metrics.frame_made();
  EXPECT_LT(metrics.not_grafted_s(), 0.03);
}

TEST(Metrics, AnIntervalBeginsAnew) {
  Metrics metrics;
  EXPECT_LT(metrics.age_of_last_frame_s(), 0);
  for (int i = 1; i <= 100; ++i) {
    metrics.time("relight", 1e-3 * i);
    metrics.frame_made();
  }
  const Metrics::Interval interval = metrics.take_interval();
  EXPECT_EQ(interval.frames, 100u);
  EXPECT_NEAR(interval.stages.at("relight").mean_ms, 50.5, 1e-3);
  EXPECT_NEAR(interval.stages.at("relight").p95_ms, 95, 1e-3);
  EXPECT_NEAR(interval.stages.at("relight").max_ms, 100, 1e-3);
  EXPECT_TRUE(metrics.take_interval().stages.empty());
  EXPECT_GE(metrics.age_of_last_frame_s(), 0);
}

TEST(ServeLog, SaysAWarningOnceAMinuteAndDropsInBatches) {
  ServeLog log;
  const auto start = ServeLog::Clock::now();
  const auto at = [&](int seconds) { return start + std::chrono::seconds(seconds); };
  EXPECT_EQ(log.lines({"dark"}, {{"fuse", 5}}, at(1)), std::vector<std::string>{"warning: dark"});
  EXPECT_TRUE(log.lines({"dark"}, {{"fuse", 9}}, at(2)).empty());
  const auto batch = log.lines({}, {{"fuse", 12}, {"relight", 1}}, at(31));
  ASSERT_EQ(batch.size(), 1u);
  EXPECT_NE(batch[0].find("fuse 12, relight 1"), std::string::npos) << batch[0];
  EXPECT_EQ(log.lines({"dark"}, {{"fuse", 12}, {"relight", 1}}, at(62)), std::vector<std::string>{"warning: dark"});
}

}  // namespace
}  // namespace lumigraft::server
