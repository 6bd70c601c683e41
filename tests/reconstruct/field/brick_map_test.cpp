#include "reconstruct/field/brick_map.h"

#include <gtest/gtest.h>

#include <map>
#include <random>

namespace lumigraft::reconstruct {
namespace {

using Map = BrickMap<int>;

// Against std::map, over copies that share clusters.
TEST(BrickMap, ContainsWhatWasPutIntoThisCopyAlone) {
  std::mt19937 random(1);
  std::vector<std::pair<Map, std::map<BrickKey, int>>> copies(1);
  for (int i = 0; i < 20000; ++i) {
    auto& [map, expected] = copies[random() % copies.size()];
    const auto coordinate = [&] { return static_cast<int>(random() % 12) - 6; };
    const BrickKey key{coordinate(), coordinate(), coordinate()};
    if (random() % 3 == 0) {
      map.erase(key);
      expected.erase(key);
    } else {
      map[key] = std::make_shared<const int>(i);
      expected[key] = i;
    }
    if (i % 4000 == 0) copies.emplace_back(copies.back());
  }
  for (const auto& [map, expected] : copies) {
    ASSERT_EQ(map.size(), expected.size());
    for (const auto& [key, value] : expected) ASSERT_EQ(*map.at(key), value);
    std::size_t listed = 0;
    for (const auto& [key, value] : map) {
      ++listed;
      ASSERT_EQ(expected.at(key), *value);
    }
    EXPECT_EQ(listed, expected.size());
  }
}

TEST(BrickMap, AnAbsentBrickIsNotFound) {
  Map map;
  EXPECT_TRUE(map.empty());
  EXPECT_EQ(map.find({0, 0, 0}), map.end());
  map[{-1, 5, 9}] = nullptr;
  EXPECT_TRUE(map.contains({-1, 5, 9})) << "a null brick is there";
  EXPECT_EQ(map.find({-2, 5, 9}), map.end()) << "in the same cluster";
  EXPECT_THROW(map.at({-2, 5, 9}), std::out_of_range);
  map.emplace({-1, 5, 9}, std::make_shared<const int>(3));
  EXPECT_EQ(map.at({-1, 5, 9}), nullptr) << "emplace keeps what is there";
  map.erase({-1, 5, 9});
  EXPECT_TRUE(map.empty());
  EXPECT_EQ(map.begin(), map.end());
}

}  // namespace
}  // namespace lumigraft::reconstruct
