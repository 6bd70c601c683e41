// Pairing of two cameras with independent clocks by arrival time on the host: the jitter and drift at which wrong
// pictures are paired.
#include <gtest/gtest.h>

#include <chrono>
#include <memory>
#include <random>

#include "capture/live/device_clock.h"
#include "capture/sync/pairing_reader.h"
#include "tests/sweeps/sweep.h"

namespace lumigraft::test {
namespace {

constexpr std::int64_t kMs = 1'000'000, kPeriod = 33 * kMs;
constexpr std::uint64_t kClockFrames = 3000, kSettled = 60;  // two seconds, for clock estimation to converge
constexpr double kLost = 0.01;

class Script : public capture::Source {
 public:
  explicit Script(std::vector<capture::SourceItem> items) : items_(std::move(items)) {}
  std::optional<capture::SourceItem> next(std::chrono::milliseconds) override {
    return finished() ? std::nullopt : std::optional<capture::SourceItem>(items_[next_++]);
  }
  bool finished() const override { return next_ == items_.size(); }
  void rewind() override { next_ = 0; }

 private:
  std::vector<capture::SourceItem> items_;
  std::size_t next_ = 0;
};

struct Outcome {
  double wrong = 0;            ///< % of pairs with different exposure times
  double unpaired = 0;         ///< % of frames without depth although both pictures arrived
  double without_warning = 0;  ///< frames without depth and without a warning
};

/// Synchronous shutters; one picture in a hundred of either camera is lost.
Outcome outcome(double jitter_ms, double drift_ppm) {
  std::mt19937 random(1);
  std::uniform_real_distribution<double> late(0.0, jitter_ms * 1e6), loss(0.0, 1.0);
  capture::DeviceClock color_clock, depth_clock;
  std::vector<capture::SourceItem> colors, depths;
  std::vector<bool> both(kClockFrames, true);
  for (std::uint64_t i = 0; i < kClockFrames; ++i) {
    const auto elapsed = static_cast<std::int64_t>(i) * kPeriod;
    const auto arrival = [&] { return 900'000 * kMs + elapsed + 3 * kMs + static_cast<std::int64_t>(late(random)); };
    const std::int64_t of_color = color_clock.to_host(elapsed, arrival());
    // The slow direction, which is worse: the minimum delay of the last second is then too short.
    const auto drifted = static_cast<std::int64_t>(static_cast<double>(elapsed) * (1 - 1e-6 * drift_ppm));
    const std::int64_t of_depth = depth_clock.to_host(77'000'000 * kMs + drifted, arrival());
    if (loss(random) < kLost) {
      both[i] = false;
    } else {
      capture::Frame picture;
      picture.stamp = {of_color, 0, i};
      picture.stream = capture::Stream::color;
      colors.emplace_back(picture);
    }
    if (loss(random) < kLost) {
      both[i] = false;
    } else {
      depths.emplace_back(capture::RawDepth{{of_depth, 0, i}, capture::Image<std::uint16_t>(1, 1, 1, 1)});
    }
  }
  capture::PairedSources sources;
  sources.color = std::make_shared<Script>(std::move(colors));
  sources.depth = std::make_shared<Script>(std::move(depths));
  capture::PairingReader reader(std::move(sources));
  Outcome result;
  double pairs = 0;
  while (const auto frame = reader.next(std::chrono::milliseconds(1))) {
    const std::uint64_t taken = frame->color->stamp.sequence;
    if (taken < kSettled) continue;
    if (frame->raw_depth) {
      ++pairs;
      result.wrong += frame->raw_depth->stamp.sequence != taken;
    } else {
      result.unpaired += both[taken];
      result.without_warning += frame->warnings.empty();
    }
  }
  result.wrong *= 100 / std::max(pairs, 1.0);
  result.unpaired *= 100.0 / static_cast<double>(kClockFrames - kSettled);
  return result;
}

TEST(ClockSweep, Jitter) {
  Sweep sweep{.stem = "clock-jitter",
              .title = "Two cameras 200 ppm apart, 30 pictures a second, one in a hundred lost",
              .x_label = "ms by which frames are late at most",
              .y_label = "% of frames",
              .x = {0, 5, 10, 20, 30, 45, 60, 90, 150, 250, 400},
              .curves = {{"wrong pairs"}, {"without depth that came"}}};
  for (const double jitter_ms : sweep.x) {
    const Outcome found = outcome(jitter_ms, 200);
    sweep.curves[0].y.push_back(found.wrong);
    sweep.curves[1].y.push_back(found.unpaired);
    EXPECT_EQ(found.without_warning, 0) << jitter_ms;
    if (jitter_ms > 30) continue;  // more than two frame intervals
    EXPECT_EQ(found.wrong, 0) << jitter_ms;
    EXPECT_LT(found.unpaired, 0.1) << jitter_ms;
  }
  write_sweep(sweep);
}

TEST(ClockSweep, Drift) {
  Sweep sweep{.stem = "clock-drift",
              .title = "Two cameras whose pictures come up to 20 ms late, one in a hundred lost",
              .x_label = "ppm by which their clocks drift apart",
              .y_label = "% of frames",
              .x = {50, 200, 1000, 3000, 6000, 10000, 20000, 40000},
              .curves = {{"wrong pairs"}, {"without depth that came"}},
              .logarithmic = true};
  for (const double drift_ppm : sweep.x) {
    const Outcome found = outcome(20, drift_ppm);
    sweep.curves[0].y.push_back(found.wrong);
    sweep.curves[1].y.push_back(found.unpaired);
    EXPECT_EQ(found.without_warning, 0) << drift_ppm;
    if (drift_ppm > 3000) continue;  // a quartz deviates by 100 ppm at most
    EXPECT_EQ(found.wrong, 0) << drift_ppm;
    EXPECT_LT(found.unpaired, 0.1) << drift_ppm;
  }
  write_sweep(sweep);
}

}  // namespace
}  // namespace lumigraft::test
