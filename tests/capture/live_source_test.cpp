// Cameras that come and go: made-up ones for every kind of fault, and the real OpenNI2 library with our test device.
#include "capture/live_source.h"

#include <gtest/gtest.h>
#include <sched.h>

#include <algorithm>
#include <atomic>
#include <cstdlib>
#include <fstream>

#include "capture/config.h"
#include "capture/error.h"
#include "capture/openni_source.h"
#include "capture/pairing_reader.h"
#include "capture/stream_spec.h"
#include "tests/capture/leaks.h"
#include "tests/capture/openni_test_pictures.h"
#include "tests/capture/scratch_folder.h"
#include "tests/capture/small_camera.h"

namespace lumigraft {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;
constexpr LivePatience kQuick{200ms, 20ms};

/// What the made-up camera does, set by the test.
struct Switches {
  std::atomic<bool> absent{false}, unplugged{false}, frozen{false}, torn{false};
  std::atomic<std::int64_t> late_ns{0};  ///< of its stamps' host clock, where it has one: before or after the arrival
  std::atomic<bool> host_clock{false};
  std::atomic<std::uint64_t> bracket{1};  ///< pictures of one moment
  std::atomic<int> opened{0}, alive{0};
  std::atomic<int> policy_of_opening{99}, policy{99};  ///< of the scheduler
};

class MadeUpCamera : public Source {
 public:
  explicit MadeUpCamera(Switches& switches) : switches_(switches) {
    ++switches_.opened;
    switches_.policy_of_opening = sched_getscheduler(0);
    if (switches_.absent) {
      throw CameraFault("found no camera");
    }
    ++switches_.alive;
  }
  ~MadeUpCamera() override { --switches_.alive; }
  std::optional<SourceItem> next(std::chrono::milliseconds timeout) override {
    switches_.policy = sched_getscheduler(0);
    if (switches_.frozen || finished()) {
      std::this_thread::sleep_for(timeout);
      return std::nullopt;
    }
    std::this_thread::sleep_for(5ms);
    const std::int64_t now_ns = steady_now_ns();
    const std::int64_t time_ns =
        switches_.host_clock ? now_ns + switches_.late_ns : static_cast<std::int64_t>(sequence_) * 5'000'000;
    const Stamp stamp{time_ns, now_ns, sequence_};
    ++sequence_;
    if (switches_.torn) {
      return LostPicture{stamp, Stream::color, "torn"};
    }
    Picture picture;
    picture.stamp = stamp;
    picture.encoded = Image<std::uint8_t>(2, 2, 3);
    return picture;
  }
  bool finished() const override { return switches_.unplugged || switches_.absent; }
  void rewind() override {}
  std::string trouble() const override { return switches_.unplugged ? "somebody pulled the plug" : ""; }
  bool on_host_clock() const override { return switches_.host_clock; }
  bool bracket_goes_on() const override { return sequence_ % switches_.bracket != 0; }

 private:
  Switches& switches_;
  std::uint64_t sequence_ = 0;
};

class LiveCamera : public testing::Test {
 protected:
  std::unique_ptr<LiveSource> open() {
    return std::make_unique<LiveSource>(
        "colour", [this] { return std::make_unique<MadeUpCamera>(switches_); }, kQuick);
  }
  /// Takes pictures until one is whole, which must be soon; their times and numbers only grow.
  void expect_pictures(LiveSource& source, int count) {
    const Clock::time_point deadline = Clock::now() + 5s;
    while (count > 0 && Clock::now() < deadline) {
      const auto item = source.next(50ms);
      if (const auto* picture = item ? std::get_if<Picture>(&*item) : nullptr) {
        EXPECT_GT(picture->stamp.time_ns, last_.time_ns);
        EXPECT_LE(picture->stamp.time_ns, steady_now_ns());
        EXPECT_GT(picture->stamp.time_ns, steady_now_ns() - 2'000'000'000);
        EXPECT_TRUE(last_.time_ns == 0 || picture->stamp.sequence > last_.sequence);
        last_ = picture->stamp;
        --count;
      }
    }
    EXPECT_EQ(count, 0);
    EXPECT_EQ(source.trouble(), "");
  }
  static void expect_trouble(LiveSource& source, const std::string& says) {
    const Clock::time_point deadline = Clock::now() + 5s;
    while (source.trouble().find(says) == std::string::npos && Clock::now() < deadline) {
      source.next(10ms);
    }
    EXPECT_EQ(source.trouble().find("colour: "), 0u) << source.trouble();
    EXPECT_NE(source.trouble().find(says), std::string::npos) << source.trouble();
    while (source.next(0ms)) {
    }
  }

  Switches switches_;
  Stamp last_;
};

TEST_F(LiveCamera, GoesBeforeOtherThreadsWhereTheSystemLetsIt) {
  const sched_param least{.sched_priority = 1}, usual{};
  const bool allowed = sched_setscheduler(0, SCHED_RR, &least) == 0;
  sched_setscheduler(0, SCHED_OTHER, &usual);
  const auto source = open();
  EXPECT_EQ(sched_getscheduler(0), SCHED_OTHER) << "who opened it stays as it was";
  expect_pictures(*source, 1);
  EXPECT_EQ(switches_.policy_of_opening, allowed ? SCHED_RR : SCHED_OTHER);
  EXPECT_EQ(switches_.policy, allowed ? SCHED_RR : SCHED_OTHER);
}

TEST_F(LiveCamera, AbsentAtTheStartItIsLookedFor) {
  switches_.absent = true;
  const auto source = open();
  expect_trouble(*source, "found no camera");
  switches_.absent = false;
  expect_pictures(*source, 3);
}

TEST_F(LiveCamera, UnpluggedAndReplugged) {
  const auto source = open();
  for (int i = 0; i < 20; ++i) {
    expect_pictures(*source, 3);
    switches_.absent = true;
    expect_trouble(*source, i % 2 == 0 ? "gone" : "found no camera");
    EXPECT_LE(switches_.alive, 1);
    switches_.absent = false;
  }
  expect_pictures(*source, 3);
}

TEST_F(LiveCamera, SaysWhatItsDriverSays) {
  const auto source = open();
  expect_pictures(*source, 3);
  switches_.unplugged = true;
  expect_trouble(*source, "colour: somebody pulled the plug, it is looked for again");
  switches_.unplugged = false;
  expect_pictures(*source, 3);
}

TEST_F(LiveCamera, StampsOfTheHostsClockAreKept) {
  switches_.host_clock = true;
  for (const std::int64_t late_ns : {-20'000'000L, 0L, 20'000'000L, -3'000'000'000L}) {
    switches_.late_ns = late_ns;
    const auto source = open();
    for (int i = 0; i < 5; ++i) {
      const auto item = source->next(1000ms);
      ASSERT_TRUE(item);
      const Stamp& stamp = stamp_of(*item);
      // Not those that lie after their arrival, or further back than any picture was on its way.
      const std::int64_t wanted_ns = late_ns == -20'000'000 ? late_ns : 0;
      EXPECT_EQ(stamp.time_ns - stamp.host_time_ns, wanted_ns) << late_ns;
    }
  }
}

TEST_F(LiveCamera, ABracketIsHandedOnAsAWhole) {
  switches_.bracket = 4;
  const auto source = open();
  for (int i = 0; i < 5; ++i) {
    auto item = source->next(1000ms);
    ASSERT_TRUE(item);
    EXPECT_EQ(stamp_of(*item).sequence % 4, 0u);
    for (std::uint64_t rest = 1; rest < 4; ++rest) {
      item = source->next(0ms);
      ASSERT_TRUE(item) << "the made-up camera takes 5 ms for each";
      EXPECT_EQ(stamp_of(*item).sequence % 4, rest);
    }
  }
}

TEST_F(LiveCamera, FrozenOrTornOnlyItIsOpenedAgain) {
  const auto source = open();
  for (std::atomic<bool>* fault : {&switches_.frozen, &switches_.torn}) {
    expect_pictures(*source, 3);
    const int opened = switches_.opened;
    *fault = true;
    expect_trouble(*source, "gives no pictures");
    *fault = false;
    expect_pictures(*source, 3);
    EXPECT_GT(switches_.opened, opened);
  }
}

TEST_F(LiveCamera, NobodyTakesItsPicturesAndItEndsAtOnce) {
  auto source = open();
  std::this_thread::sleep_for(300ms);
  expect_pictures(*source, 3);
  const Clock::time_point begin = Clock::now();
  source.reset();
  EXPECT_LT(Clock::now() - begin, 500ms);
  EXPECT_EQ(switches_.alive, 0);
}

TEST_F(LiveCamera, WhatNoPatienceMendsIsAnError) {
  EXPECT_THROW(LiveSource("colour", []() -> std::unique_ptr<Source> { throw InputError("found no such size"); }),
               InputError);
}

/// The kiosk's view: a session on the OpenNI2 test device, which a test plugs, unplugs and freezes.
class PluggedOpenNi : public test::ScratchFolder {
 protected:
  void SetUp() override {
    ScratchFolder::SetUp();
    setenv("LUMIGRAFT_TEST_PLUG", folder_.c_str(), 1);
    std::ofstream(folder_ / "session.toml") << R"(format = 1
[color]
source = "openni2:"
)" << test::kSmallCamera << R"([depth]
source = "openni2:"
unit_m = 0.001
[tag]
id = 1
size_m = 0.1
)";
  }
  void TearDown() override {
    unsetenv("LUMIGRAFT_TEST_PLUG");
    ScratchFolder::TearDown();
  }
  Session session(const std::vector<std::string>& overrides = {}) const {
    return read_session(ConfigTable::load(folder_ / "session.toml", overrides));
  }
  void set(const char* what) const { std::ofstream(folder_ / what) << ""; }
  void clear(const char* what) const { std::filesystem::remove(folder_ / what); }

  /// How long until a frame with depth is there.
  static Clock::duration wait_for_frame(FrameReader& reader) {
    const Clock::time_point begin = Clock::now();
    while (Clock::now() - begin < 10s) {
      const auto set = reader.next(100ms);
      if (set && set->depth && reader.troubles().empty()) {
        return Clock::now() - begin;
      }
    }
    ADD_FAILURE() << "no frame";
    return 10s;
  }
  static void wait_for_trouble(FrameReader& reader, const std::string& says) {
    const Clock::time_point begin = Clock::now();
    while (Clock::now() - begin < 10s) {
      reader.next(20ms);
      const std::vector<std::string> troubles = reader.troubles();
      if (troubles.size() == 1 && troubles[0].find(says) != std::string::npos) {
        EXPECT_EQ(troubles[0].find("colour and depth: "), 0u) << "one device is said once: " << troubles[0];
        return;
      }
    }
    ADD_FAILURE() << "no trouble";
  }
};

TEST_F(PluggedOpenNi, AbsentAtTheStartThenLive) {
  set("absent");
  const auto reader = open_frames(session());
  wait_for_trouble(*reader, "found nothing OpenNI2 can open");
  clear("absent");
  EXPECT_LT(wait_for_frame(*reader), 2s);
}

TEST_F(PluggedOpenNi, UnpluggedAgainAndAgain) {
  const auto reader = open_frames(session());
  wait_for_frame(*reader);
  test::Leaks leaks;
  for (int cycle = 0; cycle < test::cycles(10); ++cycle) {
    set("absent");
    wait_for_trouble(*reader, cycle % 2 == 0 ? "gone" : "found nothing");
    clear("absent");
    EXPECT_LT(wait_for_frame(*reader), 2s) << "after it came back";
    leaks.end_of_cycle();
  }
  leaks.expect_none();
}

TEST_F(PluggedOpenNi, FrozenWithoutAnError) {
  const auto reader = open_frames(session());
  wait_for_frame(*reader);
  set("frozen");
  wait_for_trouble(*reader, "gives no pictures");
  clear("frozen");
  EXPECT_LT(wait_for_frame(*reader), 4s);
}

TEST_F(PluggedOpenNi, ASizeItDoesNotOfferIsRefused) {
  EXPECT_THROW(open_frames(session({"color.width=320"})), InputError);
}

}  // namespace
}  // namespace lumigraft
