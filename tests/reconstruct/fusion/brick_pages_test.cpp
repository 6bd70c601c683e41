// The pool of published bricks.
#include "reconstruct/fusion/brick_pages.h"

#include <gtest/gtest.h>

#include <set>
#include <thread>
#include <vector>

namespace lumigraft::reconstruct {
namespace {

FieldBrick even_brick(float distance_m) {
  FieldBrick brick;
  brick.distance_m.fill(distance_m);
  brick.own_color().weight.back() = distance_m;
  return brick;
}

TEST(FieldBrickMaker, CopiesAreEqualAndOutliveTheMaker) {
  std::vector<std::shared_ptr<const FieldBrick>> bricks;
  {
    const FieldBrickMaker maker;
    for (int i = 0; i < 1000; ++i) bricks.push_back(maker.copy(even_brick(static_cast<float>(i))));
  }
  for (std::size_t i = 0; i < bricks.size(); ++i) {
    EXPECT_EQ(bricks[i]->distance_m.front(), static_cast<float>(i));
    EXPECT_EQ(bricks[i]->color->weight.back(), static_cast<float>(i));
  }
}

TEST(FieldBrickMaker, FreedSlotsAreReused) {
  const FieldBrickMaker maker;
  std::set<const FieldBrick*> places;
  for (int round = 0; round < 10; ++round) {
    std::vector<std::shared_ptr<const FieldBrick>> bricks;
    for (int i = 0; i < 300; ++i) places.insert(bricks.emplace_back(maker.copy(even_brick(1))).get());
  }
  EXPECT_EQ(places.size(), 300u);
}

TEST(FieldBrickMaker, OtherThreadsReleaseBricks) {
  const FieldBrickMaker maker;
  std::vector<std::thread> threads;
  for (int round = 0; round < 20; ++round) {
    std::vector<std::shared_ptr<const FieldBrick>> bricks;
    for (int i = 0; i < 100; ++i) bricks.push_back(maker.copy(even_brick(static_cast<float>(100 * round + i))));
    threads.emplace_back([round, held = std::move(bricks)]() mutable {
      for (std::size_t i = 0; i < held.size(); ++i)
        EXPECT_EQ(held[i]->distance_m.back(), static_cast<float>(100 * round) + static_cast<float>(i));
      held.clear();
    });
  }
  for (std::thread& thread : threads) thread.join();
}

}  // namespace
}  // namespace lumigraft::reconstruct
