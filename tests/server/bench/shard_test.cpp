#include "server/bench/shard.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>

#include "capture/error.h"
#include "server/bench/settings.h"

namespace lumigraft::server {
namespace {

/// Of three sessions with all settings.
std::vector<double> costs_of_bench() {
  std::vector<double> costs;
  for (int session = 0; session < 3; ++session) {
    for (const std::string& method : relight::plan_methods()) {
      for (const BenchSetting& setting : bench_settings(method)) costs.push_back(setting.run_s);
    }
  }
  return costs;
}

TEST(Shard, EveryRowBelongsToOne) {
  const std::vector<double> costs = costs_of_bench();
  for (const int count : {1, 2, 3, 7, 100, 1000}) {
    std::vector<int> times(costs.size(), 0);
    for (int k = 1; k <= count; ++k) {
      const std::vector<bool> chosen = rows_of({k, count}, costs);
      ASSERT_EQ(chosen.size(), costs.size());
      for (std::size_t i = 0; i < costs.size(); ++i) times[i] += chosen[i] ? 1 : 0;
    }
    EXPECT_EQ(times, std::vector<int>(costs.size(), 1)) << count;
  }
}

TEST(Shard, CostsAreEvenButForARow) {
  const std::vector<double> costs = costs_of_bench();
  const double whole = std::accumulate(costs.begin(), costs.end(), 0.0);
  const double largest = *std::max_element(costs.begin(), costs.end());
  for (const int count : {2, 3, 7}) {
    for (int k = 1; k <= count; ++k) {
      const std::vector<bool> chosen = rows_of({k, count}, costs);
      double cost = 0;
      for (std::size_t i = 0; i < costs.size(); ++i) cost += chosen[i] ? costs[i] : 0;
      EXPECT_NEAR(cost, whole / count, largest * (1 + 1e-9)) << k << "/" << count;
    }
  }
}

TEST(Shard, IsARangeOfRows) {
  const std::vector<bool> chosen = rows_of({2, 3}, costs_of_bench());
  const auto first = std::find(chosen.begin(), chosen.end(), true);
  const auto end = std::find(first, chosen.end(), false);
  EXPECT_EQ(std::find(end, chosen.end(), true), chosen.end());
  EXPECT_TRUE(rows_of({1, 2}, {}).empty());
}

TEST(Shard, Words) {
  EXPECT_EQ(parse_shard("2/3").number, 2);
  EXPECT_EQ(parse_shard("2/3").count, 3);
  for (const char* text : {"", "/", "1", "0/3", "4/3", "-1/3", "1/0", "1/3x", "a/3", " 1/3", "1/99999999999"}) {
    try {
      parse_shard(text);
      FAIL() << text;
    } catch (const capture::InputError& e) {
      EXPECT_NE(std::string(e.what()).find("--shard: found \"" + std::string(text) + '"'), std::string::npos);
    }
  }
}

}  // namespace
}  // namespace lumigraft::server
