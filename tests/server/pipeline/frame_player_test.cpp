#include "server/pipeline/frame_player.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <deque>

#include "server/pipeline/parameters.h"

namespace lumigraft::server {
namespace {

/// Time passes only while the player waits, so that no frame is late however busy the machine is.
class SimulatedTime {
 public:
  PlayClock clock() {
    return {.now = [this] { return now_; },
            .sleep_until =
                [this](PaceClock::time_point moment, const std::stop_token& stop) {
                  now_ = std::max(now_, moment);
                  return !stop.stop_requested();
                }};
  }
  PaceClock::time_point now() const { return now_; }

 private:
  PaceClock::time_point now_{std::chrono::hours(1)};
};

/// Frames every 20 ms of recorded time; counts how often they are read.
class FakeReader : public capture::SeekableReader {
 public:
  FakeReader(int count, int* reads) : count_(count), reads_(reads) {}
  std::optional<capture::FrameSet> next(std::chrono::milliseconds) override {
    if (at_ == count_) {
      return std::nullopt;
    }
    capture::FrameSet set;
    set.index = static_cast<std::uint64_t>(at_);
    set.time_ns = 1'000'000'000 + 20'000'000 * static_cast<std::int64_t>(at_++);
    auto color = std::make_shared<capture::Frame>();
    color->encoded = capture::Image<std::uint8_t>(8, 8, 3);
    set.color = color;
    ++*reads_;
    return set;
  }
  bool finished() const override { return at_ == count_; }
  void rewind() override { at_ = 0; }
  void seek(std::int64_t from_ns) override {
    at_ = std::min(static_cast<int>((from_ns + 19'999'999) / 20'000'000), count_);
  }
  std::optional<std::int64_t> length_ns() const override { return 20'000'000 * std::int64_t{count_ - 1}; }
  bool live() const override { return false; }

 private:
  int count_, at_ = 0;
  int* reads_;
};

TEST(FramePlayer, PlaysAtItsOwnPaceOverAndOver) {
  int reads = 0;
  SimulatedTime time;
  FramePlayer frames(std::make_unique<FakeReader>(5, &reads), kPipeline.memory_bytes, time.clock());
  const std::stop_source stop;
  const auto start = time.now();
  std::optional<PlayedFrame> first, played;
  for (int i = 0; i < 13; ++i) {
    played = frames.next(stop.get_token());
    ASSERT_TRUE(played);
    EXPECT_EQ(played->frame->index, static_cast<std::uint64_t>(i % 5));
    EXPECT_EQ(played->round, static_cast<std::uint64_t>(i / 5));
    first = first ? first : played;
  }
  EXPECT_EQ(played->captured - first->captured, std::chrono::milliseconds(12 * 20));
  EXPECT_EQ(time.now() - start, std::chrono::milliseconds(12 * 20));
  EXPECT_EQ(reads, 5) << "what fits in memory is decoded once";
}

TEST(FramePlayer, ReadsAgainWhatDoesNotFitInMemory) {
  int reads = 0;
  SimulatedTime time;
  FramePlayer frames(std::make_unique<FakeReader>(3, &reads), 2 * 8 * 8 * 3, time.clock());
  const std::stop_source stop;
  for (int i = 0; i < 7; ++i) {
    ASSERT_EQ(frames.next(stop.get_token())->frame->index, static_cast<std::uint64_t>(i % 3));
  }
  EXPECT_EQ(reads, 7);
}

TEST(FramePlayer, ARecordingWithoutFramesIsGone) {
  int reads = 0;
  FramePlayer frames(std::make_unique<FakeReader>(0, &reads));
  EXPECT_FALSE(frames.next(std::stop_source().get_token()));
  EXPECT_TRUE(frames.gone());
}

Playback::Orders go_to(double at_s) { return {.at_s = at_s, .paused = false, .step = false}; }
const Playback::Orders kPaused{.at_s = std::nullopt, .paused = true, .step = false};

TEST(FramePlayer, SeekWhetherFromMemoryOrNot) {
  for (const std::size_t memory : {kPipeline.memory_bytes, std::size_t{100}}) {
    int reads = 0;
    SimulatedTime time;
    FramePlayer frames(std::make_unique<FakeReader>(50, &reads), memory, time.clock());
    const std::stop_token stop;
    EXPECT_DOUBLE_EQ(frames.length_s(), 0.98);
    ASSERT_EQ(frames.next(stop)->frame->index, 0u);
    for (const int to : {30, 10, 49}) {
      const auto played = frames.next(stop, go_to(0.02 * to - 0.005));
      EXPECT_EQ(played->frame->index, static_cast<std::uint64_t>(to));
      EXPECT_EQ(time.now(), played->captured) << "at once";
      EXPECT_DOUBLE_EQ(frames.at_s(), 0.02 * to);
    }
    auto played = frames.next(stop);
    EXPECT_EQ(played->frame->index, 0u) << "it begins again";
    const std::uint64_t round = played->round;
    for (std::uint64_t i = 1; i < 50; ++i) {
      ASSERT_EQ(frames.next(stop)->frame->index, i);
    }
    EXPECT_EQ(frames.next(stop)->round, round + 1);
    reads = 0;
    played = frames.next(stop, go_to(0.5));
    EXPECT_EQ(played->frame->index, 25u);
    EXPECT_EQ(played->round, round + 2) << "time jumped";
    EXPECT_EQ(reads, memory > 1000 ? 0 : 1) << "what was played as a whole is in memory, though it was not so at first";
    EXPECT_EQ(frames.next(stop, go_to(77))->frame->index, 0u) << "after the end it begins again";
    EXPECT_EQ(frames.next(stop)->frame->index, 1u);
  }
}

TEST(FramePlayer, PauseAndStep) {
  int reads = 0;
  SimulatedTime time;
  FramePlayer frames(std::make_unique<FakeReader>(9, &reads), kPipeline.memory_bytes, time.clock());
  const std::stop_token stop;
  ASSERT_EQ(frames.next(stop, kPaused)->frame->index, 0u) << "there is something to see";
  std::int64_t last_ns = 0;
  for (int i = 0; i < 4; ++i) {
    const auto played = frames.next(stop, kPaused);
    EXPECT_EQ(played->frame->index, 0u);
    EXPECT_EQ(played->round, 0u);
    EXPECT_GT(played->frame->time_ns, last_ns) << "time goes on";
    last_ns = played->frame->time_ns;
    EXPECT_EQ(frames.at_s(), 0.0);
  }
  auto played = frames.next(stop, {.at_s = std::nullopt, .paused = true, .step = true});
  EXPECT_EQ(played->frame->index, 1u);
  EXPECT_EQ(played->round, 1u) << "time went back";
  EXPECT_EQ(frames.next(stop, kPaused)->frame->index, 1u);
  EXPECT_EQ(frames.next(stop, {.at_s = 0.1, .paused = true, .step = false})->frame->index, 5u);
  EXPECT_EQ(frames.next(stop, kPaused)->frame->index, 5u);
  EXPECT_EQ(frames.next(stop)->frame->index, 6u);
}

TEST(Playback, GivesEachOrderOnceAndKeepsThePause) {
  Playback playback;
  EXPECT_FALSE(playback.state());
  playback.apply({.at_s = 1.0, .paused = true, .step = false});
  playback.apply({.at_s = 2.0, .paused = std::nullopt, .step = true});
  const Playback::Orders first = playback.take(), second = playback.take();
  EXPECT_EQ(first.at_s, 2.0);
  EXPECT_TRUE(first.step && first.paused);
  EXPECT_FALSE(second.at_s || second.step);
  EXPECT_TRUE(second.paused);
  playback.shown(3.0, 9.0);
  EXPECT_EQ(playback.state()->at_s, 3.0);
  EXPECT_TRUE(playback.state()->paused);
}

TEST(FramePlayer, AStopEndsTheWait) {
  int reads = 0;
  SimulatedTime time;
  FramePlayer frames(std::make_unique<FakeReader>(5, &reads), kPipeline.memory_bytes, time.clock());
  std::stop_source stop;
  ASSERT_TRUE(frames.next(stop.get_token()));
  stop.request_stop();
  EXPECT_FALSE(frames.next(stop.get_token()));
}

}  // namespace
}  // namespace lumigraft::server
