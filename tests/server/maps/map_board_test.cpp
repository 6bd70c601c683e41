#include "server/maps/map_board.h"

#include <gtest/gtest.h>

#include "server/maps/parameters.h"

namespace lumigraft::server {
namespace {

using namespace std::chrono_literals;

const MapBoard::Clock::time_point kNoon{std::chrono::hours(12)};

TEST(MapBoard, AMapIsDrawnWhileItIsAskedFor) {
  MapBoard board;
  EXPECT_FALSE(board.due(kNoon)) << "nobody asked";
  EXPECT_FALSE(board.ask(MapKind::depth, kNoon));
  EXPECT_EQ(board.due(kNoon), MapKind::depth);
  board.put(MapKind::depth, {"a", 7}, kNoon);
  EXPECT_FALSE(board.due(kNoon + kMaps.apart - 1ms)) << "at most so often";
  EXPECT_EQ(board.due(kNoon + kMaps.apart), MapKind::depth);
  const auto newest = board.ask(MapKind::depth, kNoon + 1s);
  ASSERT_TRUE(newest);
  EXPECT_EQ(newest->jpeg, "a");
  EXPECT_EQ(newest->sequence, 7u);
  EXPECT_TRUE(board.due(kNoon + 1s + kMaps.asked_for));
  EXPECT_FALSE(board.due(kNoon + 1s + kMaps.asked_for + 1ms)) << "nobody asks any more";
  EXPECT_FALSE(board.ask(MapKind::depth, kNoon + 1min)) << "an old map is not shown";
}

TEST(MapBoard, SeveralMapsTakeTurns) {
  MapBoard board;
  for (const MapKind kind : kAllMaps) board.ask(kind, kNoon);
  auto now = kNoon;
  for (std::size_t i = 0; i < 3 * kAllMaps.size(); ++i) {
    EXPECT_EQ(board.due(now), kAllMaps[i % kAllMaps.size()]);
    if (i % 2 == 0) {
      board.put(kAllMaps[i % kAllMaps.size()], {"", 0}, now);
    } else {
      board.skip(kAllMaps[i % kAllMaps.size()], now);
    }
    now += 50ms;
  }
}

TEST(MapBoard, MapsHaveNames) {
  for (const MapKind kind : kAllMaps) EXPECT_EQ(map_named(name_of(kind)), kind);
  EXPECT_FALSE(map_named(""));
  EXPECT_FALSE(map_named("snapshot"));
}

}  // namespace
}  // namespace lumigraft::server
