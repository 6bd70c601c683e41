// The age of frames and pictures behind stages that are too slow or stall, with simulated clocks.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "server/pipeline/frame_player.h"
#include "server/pipeline/pacing.h"

namespace lumigraft::server {
namespace {

constexpr double kRates_hz[] = {12, 30, 60};
constexpr double kStall_s = 20, kEnd_s = 60;

PaceClock::duration seconds(double s) { return std::chrono::nanoseconds(std::llround(1e9 * s)); }
double in_s(PaceClock::duration d) { return 1e-9 * static_cast<double>(std::chrono::nanoseconds(d).count()); }

struct Aged {
  double when_s, age_s;
};

/// 95 of 100 are younger.
double age_of_95_s(const std::vector<Aged>& all, double from_s, double to_s) {
  std::vector<double> ages;
  for (const Aged& one : all)
    if (one.when_s >= from_s && one.when_s < to_s) ages.push_back(one.age_s);
  if (ages.empty()) return std::numeric_limits<double>::infinity();
  std::ranges::sort(ages);
  return ages[static_cast<std::size_t>(0.95 * static_cast<double>(ages.size()))];
}

/// A recording of 100 frames whose reading takes time, and once stalls.
class SlowReader : public capture::FrameReader {
 public:
  SlowReader(double rate_hz, double read_s, double stall_s, PaceClock::time_point* now)
      : rate_hz_(rate_hz), read_s_(read_s), stall_s_(stall_s), now_(now) {}
  std::optional<capture::FrameSet> next(std::chrono::milliseconds) override {
    if (finished()) return std::nullopt;
    *now_ += seconds(read_s_);
    if (!stalled_ && in_s(now_->time_since_epoch()) >= kStall_s) {
      stalled_ = true;
      *now_ += seconds(stall_s_);
    }
    capture::FrameSet set;
    set.index = static_cast<std::uint64_t>(at_);
    set.time_ns = std::llround(1e9 * at_++ / rate_hz_);
    auto color = std::make_shared<capture::Frame>();
    color->encoded = capture::Image<std::uint8_t>(8, 8, 3);
    set.color = color;
    return set;
  }
  bool finished() const override { return at_ == 100; }
  void rewind() override { at_ = 0; }
  bool live() const override { return false; }

 private:
  double rate_hz_, read_s_, stall_s_;
  PaceClock::time_point* now_;
  int at_ = 0;
  bool stalled_ = false;
};

/// Frames of a recording that is not held in memory.
std::vector<Aged> play(double rate_hz, double read_s, double stall_s) {
  PaceClock::time_point now{};
  PlayClock clock{.now = [&now] { return now; },
                  .sleep_until =
                      [&now](PaceClock::time_point moment, const std::stop_token&) {
                        now = std::max(now, moment);
                        return true;
                      }};
  FramePlayer frames(std::make_unique<SlowReader>(rate_hz, read_s, stall_s, &now), 100, clock);
  std::vector<Aged> out;
  while (in_s(now.time_since_epoch()) < kEnd_s) {
    const auto played = frames.next({});
    if (!played) continue;
    out.push_back({in_s(now.time_since_epoch()), in_s(now - played->captured)});
  }
  return out;
}

TEST(PictureAge, OfARecordingThatIsReadSlowlyIsBelowAPeriod) {
  for (const double rate_hz : kRates_hz) {
    for (const double slower : {0.3, 0.95, 1.1, 3.0}) {
      for (const double stall_s : {0.0, 0.4, 3.0}) {
        SCOPED_TRACE(testing::Message() << rate_hz << " Hz, reading takes " << slower << " periods, stall of "
                                        << stall_s << " s");
        const auto frames = play(rate_hz, slower / rate_hz, stall_s);
        EXPECT_LE(age_of_95_s(frames, 1, kStall_s), 1 / rate_hz);
        EXPECT_LE(age_of_95_s(frames, kStall_s + stall_s + 2, kStall_s + stall_s + 7), 1 / rate_hz);
        EXPECT_GT(static_cast<double>(frames.size()), 0.85 * (kEnd_s - stall_s) * rate_hz / std::max(slower, 1.0))
            << "few are skipped";
      }
    }
  }
}

TEST(FramePlayer, SkipsFramesThatAreLateAndKeepsTheirFisheye) {
  class Fisheye : public SlowReader {
   public:
    using SlowReader::SlowReader;
    std::optional<capture::FrameSet> next(std::chrono::milliseconds patience) override {
      auto set = SlowReader::next(patience);
      if (set && set->index == 5) set->fisheye = {std::make_shared<capture::Frame>()};
      return set;
    }
  };
  PaceClock::time_point now{};
  PlayClock clock{.now = [&now] { return now; },
                  .sleep_until =
                      [&now](PaceClock::time_point moment, const std::stop_token&) {
                        now = std::max(now, moment);
                        return true;
                      }};
  FramePlayer frames(std::make_unique<Fisheye>(10, 0, 0, &now), 100, clock);
  for (std::uint64_t i = 0; i < 4; ++i) ASSERT_EQ(frames.next({})->frame->index, i);
  now += std::chrono::milliseconds(390);
  const auto played = frames.next({});
  EXPECT_EQ(played->frame->index, 6u);
  EXPECT_EQ(played->frame->fisheye.size(), 1u);
  EXPECT_EQ(played->round, 0u) << "it is no jump";
  now += std::chrono::milliseconds(2000);
  EXPECT_EQ(frames.next({})->frame->index, 7u) << "after a long stall it continues where it was";
}

/// Camera, pose, mailboxes of the newest, relight: pipeline.h. Durations in s; one picture at kStall_s takes longer.
std::vector<Aged> draw(double rate_hz, double pose_s, double relight_s, double stall_s) {
  LatencyScheduler pace;
  const auto at = [](double s) { return PaceClock::time_point(seconds(s)); };
  std::vector<Aged> out;
  double frame = 0, begin_s = pose_s;  // number of the frame that is relit; when relight begins
  bool stalled = false;
  while (begin_s < kEnd_s) {
    pace.relight_begins(at(begin_s));
    double end_s = begin_s + relight_s;
    if (!stalled && begin_s >= kStall_s) {
      stalled = true;
      end_s += stall_s;
    }
    const double due_s = in_s(pace.pose_begins().time_since_epoch());
    double pose_begins_s = std::min(std::max(begin_s, due_s), end_s);
    const double newest = std::max(std::floor(pose_begins_s * rate_hz + 1e-6), frame + 1);
    pose_begins_s = std::max(pose_begins_s, newest / rate_hz);
    out.push_back({end_s, end_s - frame / rate_hz});
    pace.relight_ends(at(end_s));
    pace.pose_took(seconds(pose_s));
    frame = newest;
    begin_s = std::max(end_s, pose_begins_s + pose_s);
  }
  return out;
}

TEST(PictureAge, BehindSlowStagesIsTheirWorkAndAPeriod) {
  for (const double rate_hz : kRates_hz) {
    const double period_s = 1 / rate_hz;
    for (const double relight : {0.5, 0.7, 1.1, 2.5}) {
      for (const double stall_s : {0.0, 0.3, 3.0}) {
        SCOPED_TRACE(testing::Message() << rate_hz << " Hz, relight takes " << relight << " periods, stall of "
                                        << stall_s << " s");
        constexpr double kPose = 0.2;
        const auto pictures = draw(rate_hz, kPose * period_s, relight * period_s, stall_s);
        const double bound_s = (kPose + relight < 1 ? 2 : kPose + relight + 1.1) * period_s;
        EXPECT_LT(age_of_95_s(pictures, 1, kStall_s), bound_s);
        EXPECT_LT(age_of_95_s(pictures, kStall_s + stall_s + 2, kEnd_s), bound_s);
        int since_stall = 0;
        for (std::size_t i = 1; i < pictures.size(); ++i) {
          const double apart_s = pictures[i].when_s - pictures[i - 1].when_s;
          if (stall_s == 0 || pictures[i - 1].when_s < kStall_s + stall_s) continue;
          if (++since_stall < 2) continue;
          EXPECT_LT(apart_s, 2 * std::max(relight, 1.0) * period_s) << since_stall << " pictures after the stall";
        }
      }
    }
  }
}

}  // namespace
}  // namespace lumigraft::server
