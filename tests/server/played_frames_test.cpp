#include "server/played_frames.h"

#include <gtest/gtest.h>

#include <deque>

namespace lumigraft {
namespace {

/// Frames every 20 ms of recorded time; counts how often they are read.
class FakeReader : public FrameReader {
 public:
  FakeReader(int count, int* reads) : count_(count), reads_(reads) {}
  std::optional<FrameSet> next(std::chrono::milliseconds) override {
    if (at_ == count_) {
      return std::nullopt;
    }
    FrameSet set;
    set.index = static_cast<std::uint64_t>(at_);
    set.time_ns = 1'000'000'000 + 20'000'000 * static_cast<std::int64_t>(at_++);
    auto color = std::make_shared<Picture>();
    color->encoded = Image<std::uint8_t>(8, 8, 3);
    set.color = color;
    ++*reads_;
    return set;
  }
  bool finished() const override { return at_ == count_; }
  void rewind() override { at_ = 0; }
  bool live() const override { return false; }

 private:
  int count_, at_ = 0;
  int* reads_;
};

TEST(PlayedFrames, PlaysAtItsOwnPaceOverAndOver) {
  int reads = 0;
  PlayedFrames frames(std::make_unique<FakeReader>(5, &reads));
  const std::stop_source stop;
  const auto start = std::chrono::steady_clock::now();
  std::optional<PlayedFrame> first, played;
  for (int i = 0; i < 13; ++i) {
    played = frames.next(stop.get_token());
    ASSERT_TRUE(played);
    EXPECT_EQ(played->frame->index, static_cast<std::uint64_t>(i % 5));
    EXPECT_EQ(played->round, static_cast<std::uint64_t>(i / 5));
    first = first ? first : played;
  }
  EXPECT_EQ(played->captured - first->captured, std::chrono::milliseconds(12 * 20));
  EXPECT_GE(std::chrono::steady_clock::now() - start, std::chrono::milliseconds(230));
  EXPECT_EQ(reads, 5) << "what fits in memory is decoded once";
}

TEST(PlayedFrames, ReadsAgainWhatDoesNotFitInMemory) {
  int reads = 0;
  PlayedFrames frames(std::make_unique<FakeReader>(3, &reads), 2 * 8 * 8 * 3);
  const std::stop_source stop;
  for (int i = 0; i < 7; ++i) {
    ASSERT_EQ(frames.next(stop.get_token())->frame->index, static_cast<std::uint64_t>(i % 3));
  }
  EXPECT_EQ(reads, 7);
}

TEST(PlayedFrames, ARecordingWithoutFramesIsGone) {
  int reads = 0;
  PlayedFrames frames(std::make_unique<FakeReader>(0, &reads));
  EXPECT_FALSE(frames.next(std::stop_source().get_token()));
  EXPECT_TRUE(frames.gone());
}

TEST(PlayedFrames, AStopEndsTheWait) {
  int reads = 0;
  PlayedFrames frames(std::make_unique<FakeReader>(5, &reads));
  std::stop_source stop;
  ASSERT_TRUE(frames.next(stop.get_token()));
  stop.request_stop();
  EXPECT_FALSE(frames.next(stop.get_token()));
}

}  // namespace
}  // namespace lumigraft
