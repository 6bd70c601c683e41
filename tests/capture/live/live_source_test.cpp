// LiveSource with a scripted camera. Drivers are tested in openni_faults_test, aravis_source_test and camera_vm.
#include "capture/live/live_source.h"

#include <gtest/gtest.h>
#include <sched.h>

#include <algorithm>
#include <atomic>

#include "capture/error.h"
#include "capture/session/stream_spec.h"

namespace lumigraft::capture {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;
/// Longer than a busy machine delays a thread.
constexpr LivePatience kQuick{1000ms, 20ms};

/// Behaviour of the scripted camera, set by the test.
struct Switches {
  std::atomic<bool> absent{false}, unplugged{false}, frozen{false}, torn{false};
  std::atomic<std::int64_t> late_ns{0};  ///< frame time minus arrival, if it uses the host clock
  std::atomic<bool> host_clock{false};
  std::atomic<std::uint64_t> bracket{1};  ///< frames per bracket
  std::atomic<int> opened{0}, alive{0};
  std::atomic<int> policy_of_opening{99}, policy{99};  ///< scheduling policy
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
      return LostFrame{stamp, Stream::color, "torn"};
    }
    Frame picture;
    picture.stamp = stamp;
    picture.encoded = Image<std::uint8_t>(2, 2, 3);
    return picture;
  }
  bool finished() const override { return switches_.unplugged || switches_.absent; }
  void rewind() override {}
  std::string fault() const override { return switches_.unplugged ? "somebody pulled the plug" : ""; }
  bool on_host_clock() const override { return switches_.host_clock; }
  bool bracket_incomplete() const override { return sequence_ % switches_.bracket != 0; }

 private:
  Switches& switches_;
  std::uint64_t sequence_ = 0;
};

class LiveCamera : public testing::Test {
 protected:
  std::unique_ptr<LiveSource> open() {
    opened_ns_ = steady_now_ns();
    return std::make_unique<LiveSource>(
        "colour", [this] { return std::make_unique<MadeUpCamera>(switches_); }, kQuick);
  }
  /// The next complete frame, which must come soon. Checks that times and sequence numbers increase.
  void expect_frames(LiveSource& source, int count) {
    const Clock::time_point deadline = Clock::now() + 5s;
    while (count > 0 && Clock::now() < deadline) {
      const auto item = source.next(50ms);
      if (const auto* picture = item ? std::get_if<Frame>(&*item) : nullptr) {
        EXPECT_GT(picture->stamp.time_ns, last_.time_ns);
        EXPECT_LE(picture->stamp.time_ns, steady_now_ns());
        EXPECT_GT(picture->stamp.time_ns, steady_now_ns() - 2'000'000'000);
        EXPECT_TRUE(last_.time_ns == 0 || picture->stamp.sequence > last_.sequence);
        last_ = picture->stamp;
        --count;
      }
    }
    EXPECT_EQ(count, 0);
    EXPECT_EQ(source.fault(), "");
  }
  static void expect_fault(LiveSource& source, const std::string& says) {
    const Clock::time_point deadline = Clock::now() + 5s;
    while (source.fault().find(says) == std::string::npos && Clock::now() < deadline) {
      source.next(10ms);
    }
    EXPECT_EQ(source.fault().find("colour: "), 0u) << source.fault();
    EXPECT_NE(source.fault().find(says), std::string::npos) << source.fault();
    while (source.next(0ms)) {
    }
  }

  Switches switches_;
  std::int64_t opened_ns_ = 0;
  Stamp last_;
};

TEST_F(LiveCamera, RunsAtRealtimePriorityIfPermitted) {
  const sched_param lowest{.sched_priority = 1}, usual{};
  const bool allowed = sched_setscheduler(0, SCHED_RR, &lowest) == 0;
  sched_setscheduler(0, SCHED_OTHER, &usual);
  const auto source = open();
  EXPECT_EQ(sched_getscheduler(0), SCHED_OTHER) << "the priority of the opening thread is restored";
  expect_frames(*source, 1);
  EXPECT_EQ(switches_.policy_of_opening, allowed ? SCHED_RR : SCHED_OTHER);
  EXPECT_EQ(switches_.policy, allowed ? SCHED_RR : SCHED_OTHER);
}

TEST_F(LiveCamera, AbsentAtTheStartItIsSearchedFor) {
  switches_.absent = true;
  const auto source = open();
  expect_fault(*source, "found no camera");
  switches_.absent = false;
  expect_frames(*source, 3);
}

TEST_F(LiveCamera, DropsTheFirstFramesOfAnUnknownClock) {
  const auto source = open();
  const auto first = source->next(1000ms);
  ASSERT_TRUE(first);
  EXPECT_EQ(stamp_of(*first).sequence, 0u) << "dropped frames are not counted";
  EXPECT_GT(stamp_of(*first).host_time_ns - opened_ns_, 20'000'000) << "four frames of 5 ms";
  const auto second = source->next(1000ms);
  ASSERT_TRUE(second);
  EXPECT_EQ(stamp_of(*second).sequence, 1u);
}

TEST_F(LiveCamera, UnpluggedAndReplugged) {
  const auto source = open();
  for (int i = 0; i < 20; ++i) {
    expect_frames(*source, 3);
    switches_.absent = true;
    expect_fault(*source, i % 2 == 0 ? "disconnected" : "found no camera");
    EXPECT_LE(switches_.alive, 1);
    switches_.absent = false;
  }
  expect_frames(*source, 3);
}

TEST_F(LiveCamera, ReportsTheDriversFault) {
  const auto source = open();
  expect_frames(*source, 3);
  switches_.unplugged = true;
  expect_fault(*source, "colour: somebody pulled the plug, it is searched for again");
  switches_.unplugged = false;
  expect_frames(*source, 3);
}

TEST_F(LiveCamera, KeepsTimesOfTheHostClock) {
  switches_.host_clock = true;
  for (const std::int64_t late_ns : {-20'000'000L, 0L, 20'000'000L, -3'000'000'000L}) {
    switches_.late_ns = late_ns;
    const auto source = open();
    for (int i = 0; i < 5; ++i) {
      const auto item = source->next(1000ms);
      ASSERT_TRUE(item);
      const Stamp& stamp = stamp_of(*item);
      // Times after the arrival, or earlier than any latency explains, are not kept.
      const std::int64_t wanted_ns = late_ns == -20'000'000 ? late_ns : 0;
      EXPECT_EQ(stamp.time_ns - stamp.host_time_ns, wanted_ns) << late_ns;
    }
  }
}

TEST_F(LiveCamera, DeliversABracketAtOnce) {
  switches_.bracket = 4;
  const auto source = open();
  for (int i = 0; i < 5; ++i) {
    auto item = source->next(1000ms);
    ASSERT_TRUE(item);
    EXPECT_EQ(stamp_of(*item).sequence % 4, 0u);
    for (std::uint64_t rest = 1; rest < 4; ++rest) {
      item = source->next(0ms);
      ASSERT_TRUE(item) << "the camera takes 5 ms per frame";
      EXPECT_EQ(stamp_of(*item).sequence % 4, rest);
    }
  }
}

TEST_F(LiveCamera, IsReopenedIfFrozenOrOnlyDamaged) {
  const auto source = open();
  for (const auto& [fault, says] :
       {std::pair(&switches_.frozen, "the camera delivers no frames, it is opened again"),
        std::pair(&switches_.torn, "the camera delivers no intact frames (torn), it is opened again")}) {
    expect_frames(*source, 3);
    const int opened = switches_.opened;
    *fault = true;
    expect_fault(*source, says);
    *fault = false;
    expect_frames(*source, 3);
    EXPECT_GT(switches_.opened, opened);
  }
}

TEST_F(LiveCamera, DropsOldFramesAndClosesAtOnce) {
  auto source = open();
  std::this_thread::sleep_for(300ms);
  expect_frames(*source, 3);
  const Clock::time_point begin = Clock::now();
  source.reset();
  EXPECT_LT(Clock::now() - begin, 500ms);
  EXPECT_EQ(switches_.alive, 0);
}

TEST_F(LiveCamera, APermanentFaultIsAnError) {
  EXPECT_THROW(LiveSource("colour", []() -> std::unique_ptr<Source> { throw InputError("found no such size"); }),
               InputError);
}

}  // namespace
}  // namespace lumigraft::capture
