#include "capture/sync/pairing_reader.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <random>
#include <thread>

#include "capture/live/device_clock.h"

namespace lumigraft::capture {
namespace {

using namespace std::chrono_literals;
using Items = std::vector<SourceItem>;

constexpr std::int64_t kMs = 1'000'000;

Frame picture(Stream stream, std::uint64_t sequence, std::int64_t time_ms) {
  Frame p;
  p.stamp = {time_ms * kMs, 0, sequence};
  p.stream = stream;
  return p;
}
Frame color(std::uint64_t sequence, std::int64_t time_ms) { return picture(Stream::color, sequence, time_ms); }
Frame fisheye(std::uint64_t sequence, std::int64_t time_ms) { return picture(Stream::fisheye, sequence, time_ms); }
RawDepth depth(std::uint64_t sequence, std::int64_t time_ms) {
  return {{time_ms * kMs, 0, sequence}, Image<std::uint16_t>(1, 1, 1, static_cast<std::uint16_t>(sequence + 1))};
}
LostFrame lost(Stream stream, std::uint64_t sequence, std::int64_t time_ms) {
  return {{time_ms * kMs, 0, sequence}, stream, "torn"};
}

class Script : public Source {
 public:
  explicit Script(Items items) : items_(std::move(items)) {}
  std::optional<SourceItem> next(std::chrono::milliseconds) override {
    return finished() ? std::nullopt : std::optional<SourceItem>(items_[next_++]);
  }
  bool finished() const override { return next_ == items_.size(); }
  void rewind() override { next_ = 0; }

 private:
  Items items_;
  std::size_t next_ = 0;
};

std::shared_ptr<Script> script(Items items) { return std::make_shared<Script>(std::move(items)); }

/// "colour sequence / depth sequence / fish-eye sequences" for each frame, and its warnings after it.
std::vector<std::string> play(FrameReader& reader) {
  std::vector<std::string> out;
  while (const auto set = reader.next(10ms)) {
    EXPECT_EQ(set->index, set->color->stamp.sequence);
    EXPECT_EQ(set->time_ns, set->color->stamp.time_ns);
    std::string line = std::to_string(set->index) + "/";
    EXPECT_FALSE(set->depth) << "nobody registered it";
    if (set->raw_depth != nullptr) {
      line += std::to_string(set->raw_depth->stamp.sequence);
      EXPECT_EQ(set->raw_depth->counts.data[0], set->raw_depth->stamp.sequence + 1);
    }
    line += "/";
    for (const auto& f : set->fisheye) {
      line += std::to_string(f->stamp.sequence);
    }
    out.push_back(line);
    out.insert(out.end(), set->warnings.begin(), set->warnings.end());
  }
  EXPECT_TRUE(reader.finished());
  return out;
}

std::vector<std::string> play(Items colors, Items depths, Items fisheyes = {}) {
  PairedSources sources;
  sources.color = script(std::move(colors));
  sources.depth = script(std::move(depths));
  if (!fisheyes.empty()) {
    sources.fisheye = script(std::move(fisheyes));
  }
  PairingReader reader(std::move(sources));
  EXPECT_FALSE(reader.live());
  auto once = play(reader);
  reader.rewind();
  EXPECT_EQ(play(reader), once) << "rewound";
  return once;
}

using Lines = std::vector<std::string>;

TEST(PairingReader, EqualTimesPair) {
  EXPECT_EQ(play({color(0, 0), color(1, 33), color(2, 67)}, {depth(0, 0), depth(1, 33), depth(2, 67)},
                 {fisheye(0, 0), fisheye(1, 33), fisheye(2, 67)}),
            (Lines{"0/0/0", "1/1/1", "2/2/2"}));
}

TEST(PairingReader, TheFisheyesTimesAreShiftedBeforeTheyPair) {
  PairedSources sources;
  sources.color = script({color(0, 0), color(1, 33), color(2, 67)});
  sources.fisheye = script({fisheye(0, 30), fisheye(1, 63), lost(Stream::fisheye, 2, 97)});
  sources.fisheye_offset_ns = -30 * kMs;
  PairingReader reader(std::move(sources));
  EXPECT_EQ(play(reader), (Lines{"0//0", "1//1", "2//", "fish-eye picture 2 lost: torn"}));
  reader.rewind();
  EXPECT_EQ(reader.next(10ms)->fisheye.at(0)->stamp.time_ns, 0) << "on the colour camera's clock";
}

TEST(PairingReader, TheNearestWithinHalfAPeriodPairs) {
  EXPECT_EQ(
      play({color(0, 100), color(1, 133), color(2, 167)}, {depth(0, 90), depth(1, 112), depth(2, 130), depth(3, 175)}),
      (Lines{"0/0/", "1/2/", "1 depth picture late or without a colour picture: dropped", "2/3/"}));
}

TEST(PairingReader, NothingPairsBeyondTheBound) {
  EXPECT_EQ(play({color(0, 0), color(1, 40), color(2, 80)}, {depth(0, 0), depth(1, 61), depth(2, 101)}),
            (Lines{"0/0/", "1//", "no depth picture within 20 ms of the colour picture", "2/1/"}));
}

TEST(PairingReader, ALostColorFrameKeepsItsIndex) {
  EXPECT_EQ(play({color(0, 0), lost(Stream::color, 1, 33), color(2, 67)}, {depth(0, 0), depth(1, 33), depth(2, 67)}),
            (Lines{"0/0/", "2/2/", "colour picture 1 lost: torn",
                   "1 depth picture late or without a colour picture: dropped"}));
}

TEST(PairingReader, WhatIsLostAtTheEndsIsNamedToo) {
  EXPECT_EQ(
      play({lost(Stream::color, 0, 0), color(1, 33), lost(Stream::color, 2, 67), lost(Stream::color, 3, 100)},
           {depth(0, 33)}),
      (Lines{"1/0/", "colour picture 0 lost: torn", "colour picture 2 lost: torn", "colour picture 3 lost: torn"}));
}

TEST(PairingReader, ALostDepthFrameLeavesItsSetWithout) {
  EXPECT_EQ(play({color(0, 0), color(1, 34), color(2, 68)}, {depth(0, 0), lost(Stream::depth, 1, 34), depth(2, 68)}),
            (Lines{"0/0/", "1//", "depth picture 1 lost: torn", "2/2/"}));
}

TEST(PairingReader, GapsInTheSequenceAreCounted) {
  EXPECT_EQ(play({color(0, 0), color(3, 99)}, {depth(0, 0), depth(3, 99)}),
            (Lines{"0/0/", "3/3/", "2 colour pictures missing before picture 3",
                   "2 depth pictures missing before picture 3"}));
}

TEST(PairingReader, TimesThatGoBackAreDropped) {
  EXPECT_EQ(play({color(0, 0), color(1, 33), color(2, 20), color(3, 67)},
                 {depth(0, 0), depth(1, 33), depth(2, 33), depth(3, 67)}),
            (Lines{"0/0/", "1/1/", "3/3/", "colour picture 2 is 13 ms older than the one before: dropped",
                   "depth picture 2 is 0 ms older than the one before: dropped"}));
}

/// Two cameras of one room, shutters together: their clocks drift apart by 200 ppm, their pictures take 3 to 23 ms, one
/// in a hundred is lost. What is put on the host's clock as live cameras are is paired right, and all else is counted.
TEST(PairingReader, JitterLossAndDriftMakeNoWrongPair) {
  int wrong = 0, pairs = 0;
  for (unsigned seed = 1; seed <= 20; ++seed) {
    std::mt19937 random(seed);
    std::uniform_real_distribution<double> latency(3e6, 23e6), chance(0.0, 1.0);
    Items colors, depths;
    std::vector<bool> has_color, has_depth;
    DeviceClock color_clock, depth_clock;
    constexpr std::uint64_t kMoments = 3000, kKeptBack = 4;
    for (std::uint64_t i = 0; i < kMoments; ++i) {
      const bool ends = i <= kKeptBack || i + 1 == kMoments;  // losses before the first or after the last are unknown
      has_color.push_back(ends || chance(random) >= 0.01);
      has_depth.push_back(ends || chance(random) >= 0.01);
      const std::int64_t elapsed = static_cast<std::int64_t>(i) * 33 * kMs, truth = 900'000 * kMs + elapsed;
      const auto stamp = [&](DeviceClock& clock, double rate) {
        const auto device = static_cast<std::int64_t>(rate * static_cast<double>(elapsed));
        const std::int64_t arrival = truth + static_cast<std::int64_t>(latency(random));
        return Stamp{clock.to_host(device, arrival), arrival, i - kKeptBack};
      };
      if (i < kKeptBack) {
        stamp(color_clock, 1.0);
        stamp(depth_clock, 1.0002);
        continue;
      }
      if (has_color.back()) {
        Frame p = color(i - kKeptBack, 0);
        p.stamp = stamp(color_clock, 1.0);
        colors.emplace_back(std::move(p));
      }
      if (has_depth.back()) {
        RawDepth d = depth(i - kKeptBack, 0);
        d.stamp = stamp(depth_clock, 1.0002);
        depths.emplace_back(std::move(d));
      }
    }
    const auto color_lost = std::count(has_color.begin(), has_color.end(), false);
    const auto depth_lost = std::count(has_depth.begin(), has_depth.end(), false);
    const auto depth_came = static_cast<int>(depths.size());
    PairedSources sources;
    sources.color = script(std::move(colors));
    sources.depth = script(std::move(depths));
    PairingReader reader(std::move(sources));
    int color_missing = 0, depth_missing = 0, alone = 0, without = 0, paired = 0;
    while (const auto set = reader.next(10ms)) {
      without += set->raw_depth ? 0 : 1;
      paired += set->raw_depth ? 1 : 0;
      wrong += set->raw_depth && set->raw_depth->stamp.sequence != set->index ? 1 : 0;
      for (const std::string& warning : set->warnings) {
        const auto says = [&](const char* what) { return warning.find(what) != std::string::npos; };
        const int count = std::atoi(warning.c_str());
        color_missing += says("colour pictures missing") ? count : 0;
        depth_missing += says("depth pictures missing") ? count : 0;
        alone += says("late or without a colour picture") ? count : 0;
        without -= says("no depth picture within") ? 1 : 0;
      }
    }
    EXPECT_EQ(color_missing, color_lost) << seed;
    EXPECT_EQ(depth_missing, depth_lost) << seed;
    EXPECT_EQ(paired + alone, depth_came) << seed;
    EXPECT_EQ(without, 0) << seed << ": each is named";
    pairs += paired;
  }
  EXPECT_EQ(wrong, 0) << "of " << pairs;
}

TEST(PairingReader, ABracketStaysTogether) {
  EXPECT_EQ(
      play({color(0, 0), color(1, 33), color(2, 67)}, {depth(0, 0), depth(1, 33), depth(2, 67)},
           {fisheye(0, 2), fisheye(1, 2), fisheye(2, 2), fisheye(3, 68), lost(Stream::fisheye, 4, 68), fisheye(5, 68)}),
      (Lines{"0/0/012", "1/1/", "2/2/35", "fish-eye picture 4 lost: torn"}));
}

TEST(PairingReader, ASlowFisheyeLeavesFramesWithoutOneAndSaysNothing) {
  EXPECT_EQ(
      play({color(0, 0), color(1, 33), color(2, 67), color(3, 100), color(4, 133)},
           {depth(0, 0), depth(1, 33), depth(2, 67), depth(3, 100), depth(4, 133)}, {fisheye(0, 5), fisheye(1, 105)}),
      (Lines{"0/0/0", "1/1/", "2/2/", "3/3/1", "4/4/"}));
}

TEST(PairingReader, ADepthStreamThatEndsEarlyStopsNothing) {
  const Lines lines = play({color(0, 0), color(1, 33), color(2, 67)}, {depth(0, 0)});
  EXPECT_EQ(lines, (Lines{"0/0/", "1//", "no depth picture within 17 ms of the colour picture", "2//",
                          "no depth picture within 17 ms of the colour picture"}));
}

TEST(PairingReader, OneSourceForTwoStreamsPairsTheSameWhateverItsOrder) {
  const auto run = [](bool depth_first) {
    Items items;
    for (std::uint64_t i = 0; i < 40; ++i) {
      const auto time_ms = static_cast<std::int64_t>(33 * i + (i * i) % 5);
      const bool first = depth_first == (i % 3 != 0);
      if (i == 7) {
        items.push_back(lost(Stream::depth, i, time_ms));
        items.push_back(color(i, time_ms + 4));
        continue;
      }
      if (first) {
        items.emplace_back(depth(i, time_ms));
        items.emplace_back(color(i, time_ms + 4));
      } else {
        items.emplace_back(color(i, time_ms + 4));
        items.emplace_back(depth(i, time_ms));
      }
    }
    PairedSources sources;
    sources.color = sources.depth = script(items);
    PairingReader reader(std::move(sources));
    return play(reader);
  };
  EXPECT_EQ(run(true), run(false));
  EXPECT_EQ(run(true).size(), 41u) << "40 frames and the word about one lost picture";
}

TEST(PairingReader, ASharedSourceWithoutDepthIsNotReadIntoMemoryCompletely) {
  Items items;
  for (std::uint64_t i = 0; i < 100; ++i) {
    items.push_back(color(i, static_cast<std::int64_t>(33 * i)));
  }
  auto source = script(items);
  PairedSources sources;
  sources.color = sources.depth = source;
  PairingReader reader(std::move(sources));
  EXPECT_TRUE(reader.next(10ms));
  int left = 0;
  while (source->next(0ms)) {
    ++left;
  }
  EXPECT_GT(left, 80);
}

/// A device: items come when a test gives them.
class Device : public Source {
 public:
  std::optional<SourceItem> next(std::chrono::milliseconds timeout) override {
    if (items_.empty()) {
      std::this_thread::sleep_for(timeout);
      return std::nullopt;
    }
    SourceItem item = items_.front();
    items_.pop_front();
    return item;
  }
  bool finished() const override { return gone; }
  void rewind() override {}
  void give(SourceItem item) { items_.push_back(std::move(item)); }
  bool gone = false;

 private:
  std::deque<SourceItem> items_;
};

TEST(PairingReader, LiveWaitsForDepthOnePeriodAndNoLonger) {
  auto device = std::make_shared<Device>();
  PairedSources sources{device, device, nullptr, true};
  PairingReader reader(std::move(sources));
  EXPECT_TRUE(reader.live());
  EXPECT_FALSE(reader.next(5ms));
  EXPECT_FALSE(reader.finished());

  device->give(color(0, 1000));
  device->give(depth(0, 1001));
  const auto first = reader.next(1s);
  ASSERT_TRUE(first);
  EXPECT_TRUE(first->raw_depth);

  device->give(color(1, 1033));
  const auto start = std::chrono::steady_clock::now();
  const auto second = reader.next(5s);
  ASSERT_TRUE(second);
  EXPECT_FALSE(second->raw_depth);
  EXPECT_LT(std::chrono::steady_clock::now() - start, 2s);

  device->give(depth(1, 1034));  // too late
  device->give(color(2, 1067));
  device->give(depth(2, 1068));
  const auto third = reader.next(1s);
  ASSERT_TRUE(third && third->raw_depth);
  EXPECT_EQ(third->raw_depth->stamp.sequence, 2u);
  EXPECT_EQ(third->warnings, Lines{"1 depth picture late or without a colour picture: dropped"});

  device->gone = true;
  EXPECT_FALSE(reader.next(1s));
  EXPECT_TRUE(reader.finished());
}

/// "colour/depth" of the next FrameSet of live cameras.
std::string live_pair(PairingReader& reader) {
  const auto set = reader.next(1s);
  if (!set) return "none";
  return std::to_string(set->index) + "/" + (set->raw_depth ? std::to_string(set->raw_depth->stamp.sequence) : "");
}

TEST(PairingReader, WhoReadsLiveFramesTooSlowlyGetsTheNewestThatPairs) {
  auto device = std::make_shared<Device>();
  PairingReader reader(PairedSources{device, device, nullptr, true});
  for (std::uint64_t i = 0; i < 10; ++i) {  // the reader stands still for ten periods
    device->give(color(i, 1000 + 33 * std::int64_t(i)));
    if (i < 8) device->give(depth(i, 1001 + 33 * std::int64_t(i)));
  }
  const auto set = reader.next(1s);
  ASSERT_TRUE(set);
  EXPECT_EQ(set->index, 7u);
  EXPECT_TRUE(set->raw_depth);
  EXPECT_EQ(set->warnings, (Lines{"7 colour pictures skipped: newer ones had come",
                                  "7 depth pictures late or without a colour picture: dropped"}));
  device->give(depth(8, 1265));
  EXPECT_EQ(live_pair(reader), "8/8") << "9 may still get its depth";
  EXPECT_EQ(live_pair(reader), "9/") << "it gets none within a period";
}

TEST(PairingReader, LiveWaitsForNoDepthThatItsCameraIsTooSlowToGive) {
  auto device = std::make_shared<Device>();
  PairingReader reader(PairedSources{device, device, nullptr, true});
  for (std::uint64_t i = 0; i < 4; i += 2) {  // colour at 1 Hz, depth at half of it
    device->give(color(i, 1000 + 1000 * std::int64_t(i)));
    device->give(depth(i / 2, 1001 + 1000 * std::int64_t(i)));
    EXPECT_EQ(live_pair(reader), std::to_string(i) + "/" + std::to_string(i / 2));
  }
  device->give(color(3, 4000));
  const auto without = reader.next(0ms);
  ASSERT_TRUE(without);
  EXPECT_EQ(without->index, 3u);
  device->give(color(4, 5000));
  EXPECT_FALSE(reader.next(0ms)) << "one may come";
}

/// The fish-eye pictures of the next FrameSet, and its warnings.
std::string live_fisheyes(PairingReader& reader) {
  const auto set = reader.next(1s);
  if (!set) {
    return "no picture";
  }
  std::string out;
  for (const auto& one : set->fisheye) {
    out += std::to_string(one->stamp.sequence) + " ";
  }
  for (const std::string& warning : set->warnings) {
    out += warning;
  }
  return out;
}

TEST(PairingReader, ALiveFisheyeThatComesAfterItsColourFrameJoinsTheNext) {
  auto camera = std::make_shared<Device>();
  auto above = std::make_shared<Device>();
  PairingReader reader(PairedSources{camera, nullptr, above, true});
  const auto color_at = [&](std::uint64_t number) { camera->give(color(number, 1000 + 33 * std::int64_t(number))); };
  color_at(0);
  EXPECT_EQ(live_fisheyes(reader), "") << "it waits for no fish-eye";
  for (std::uint64_t i = 0; i < 3; ++i) above->give(fisheye(i, 1010));  // a bracket of the first picture's period
  color_at(1);
  EXPECT_EQ(live_fisheyes(reader), "0 1 2 ");
  color_at(2);
  EXPECT_EQ(live_fisheyes(reader), "") << "each is used once";
  for (std::uint64_t i = 3; i < 6; ++i) above->give(fisheye(i, 1070));
  for (std::uint64_t i = 6; i < 9; ++i) above->give(fisheye(i, 1100));
  color_at(5);
  EXPECT_EQ(live_fisheyes(reader),
            "6 7 8 2 colour pictures missing before picture 53 fish-eye pictures late or without a colour picture: "
            "dropped");
  above->give(fisheye(9, 1200));
  color_at(6);
  EXPECT_EQ(live_fisheyes(reader), "9 ") << "the nearest where there is one, however late it is";
  above->give(fisheye(10, 1300));
  color_at(18);
  EXPECT_EQ(live_fisheyes(reader).substr(0, 1), "1") << "290 ms are";
}

TEST(PairingReader, ALiveBracketIsNeverTakenInHalf) {
  auto camera = std::make_shared<Device>();
  auto above = std::make_shared<Device>();
  PairingReader reader(PairedSources{camera, nullptr, above, true});
  for (std::uint64_t i = 0; i < 30; ++i) above->give(fisheye(i, 1000 + 10 * std::int64_t(i / 3)));
  camera->give(color(0, 1100));
  EXPECT_EQ(live_fisheyes(reader).substr(0, 9), "27 28 29 ") << "more came than are kept";
}

/// A live fish-eye that never rests.
class Tireless : public Source {
 public:
  std::optional<SourceItem> next(std::chrono::milliseconds) override {
    Frame p = fisheye(next_, 33 * static_cast<std::int64_t>(next_));
    ++next_;
    p.original = std::make_shared<RawFrame>();
    given.push_back(p.original);
    return p;
  }
  bool finished() const override { return false; }
  void rewind() override {}

  std::vector<std::weak_ptr<const RawFrame>> given;

 private:
  std::uint64_t next_ = 0;
};

/// A camera that is away.
class Away : public Source {
 public:
  std::optional<SourceItem> next(std::chrono::milliseconds) override { return std::nullopt; }
  bool finished() const override { return false; }
  void rewind() override {}
};

TEST(PairingReader, KeepsNoFramesForALiveColourCameraThatIsAway) {
  const auto tireless = std::make_shared<Tireless>();
  PairedSources sources;
  sources.color = std::make_shared<Away>();
  sources.fisheye = tireless;
  sources.live = true;
  PairingReader reader(sources);
  while (tireless->given.size() < 200) EXPECT_FALSE(reader.next(1ms));
  const auto kept = std::count_if(tireless->given.begin(), tireless->given.end(),
                                  [](const std::weak_ptr<const RawFrame>& one) { return !one.expired(); });
  EXPECT_LE(kept, 16);
  EXPECT_GT(kept, 0);
}

}  // namespace
}  // namespace lumigraft::capture
