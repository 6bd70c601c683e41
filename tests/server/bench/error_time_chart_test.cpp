#include "server/bench/error_time_chart.h"

#include <gtest/gtest.h>

#include <cmath>

namespace lumigraft::server {
namespace {

BenchRow row(const std::string& session, const std::string& setting, double error, double cpu_ms, double still_ms) {
  BenchRow row{session, "dvct", setting, "none", {}, {}};
  row.run.measures.relight_error = error;
  row.run.moving.host.cpu_ms = cpu_ms;
  row.run.still.host.cpu_ms = still_ms;
  return row;
}

TEST(BenchErrorTime, MeansOfSettingsThatEverySessionHas) {
  const std::vector<BenchRow> rows{row("a", "live-64", 0.2, 100, 10), row("a", "half-64", 0.1, 300, 200),
                                   row("b", "live-64", 0.4, 200, 30), row("b", "half-64", NAN, 500, 200)};
  const std::vector<SettingMean> means = mean_over_sessions(rows, CostKind::cpu);
  ASSERT_EQ(means.size(), 1u);  // half-64 has no error on b
  EXPECT_EQ(means[0].setting, "live-64");
  EXPECT_NEAR(means[0].relight_error, 0.3, 1e-12);
  EXPECT_NEAR(means[0].cost_ms, 150, 1e-12);
  EXPECT_NEAR(means[0].still_cost_ms, 20, 1e-12);
  EXPECT_TRUE(mean_over_sessions(rows, CostKind::gpu).empty());
}

TEST(BenchErrorTime, TheFrontIsWhatNothingBeats) {
  const auto mean = [](double error, double cost_ms) {
    return SettingMean{.method = "dvct", .setting = "", .relight_error = error, .cost_ms = cost_ms};
  };
  const std::vector<SettingMean> means{mean(0.1, 900), mean(0.3, 100), mean(0.35, 200), mean(0.2, 300), mean(0.2, 400)};
  EXPECT_EQ(pareto_front(means), (std::vector<std::size_t>{1, 3, 0}));
}

TEST(BenchErrorTime, WithoutATimeThereIsNoChart) {
  BenchResults results;
  results.rows = {row("a", "live-64", 0.2, 100, 10)};
  const std::filesystem::path stem = std::filesystem::path(testing::TempDir()) / "lumigraft-error-time";
  draw_error_time(results, CostKind::gpu, stem);
  EXPECT_FALSE(std::filesystem::exists(stem.string() + ".png"));
  draw_error_time(results, CostKind::cpu, stem);
  EXPECT_TRUE(std::filesystem::exists(stem.string() + ".png"));
  std::filesystem::remove(stem.string() + ".png");
  std::filesystem::remove(stem.string() + ".svg");
}

}  // namespace
}  // namespace lumigraft::server
