// Faults of a depth camera, produced by the test device below the real OpenNI2 library, and their effect on the frames
// of a session.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <vector>

#include "capture/error.h"
#include "capture/session/config.h"
#include "capture/session/stream_spec.h"
#include "capture/sync/pairing_reader.h"
#include "tests/capture/live/gige_camera.h"
#include "tests/capture/live/leaks.h"
#include "tests/capture/live/openni_test_pictures.h"
#include "tests/capture/live/small_camera.h"
#include "tests/capture/scratch_folder.h"

namespace lumigraft::capture {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;

/// Index of the device's frame, modulo 256 for colour and modulo 100 for depth.
int shown(const Frame& color) {
  constexpr int kInverseOf5 = 205;  // modulo 256; see device_color
  return color.encoded.at(0, 0, 2) * kInverseOf5 % 256;
}
int shown(const DepthFrame& depth) {
  constexpr int kColumn = 8, kInverseOf7 = 43;  // modulo 100; see device_depth
  const auto counts = static_cast<int>(std::lround(1000.0f * depth.depth_m.at(kColumn, 0)));
  return (counts - test::device_depth(0, kColumn, 0)) * kInverseOf7 % 100;
}

/// Summary of the frames of some time.
struct Summary {
  int frames = 0, without_depth = 0;
  std::uint64_t left_out = 0;  ///< frame indices missing between the first and the last
  Clock::duration longest_wait{};
  std::string warnings;

  bool says(const std::string& words) const { return warnings.find(words) != std::string::npos; }
};

class OpenNiFaults : public test::ScratchFolder {
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

  /// Time until a frame with depth arrives.
  static Clock::duration wait_for_frame(FrameReader& reader) {
    const Clock::time_point begin = Clock::now();
    while (Clock::now() - begin < 10s) {
      const auto set = reader.next(100ms);
      if (set && set->depth && reader.faults().empty()) {
        return Clock::now() - begin;
      }
    }
    ADD_FAILURE() << "no frame";
    return 10s;
  }
  static void wait_for_fault(FrameReader& reader, const std::string& says) {
    const Clock::time_point begin = Clock::now();
    while (Clock::now() - begin < 10s) {
      reader.next(20ms);
      const std::vector<std::string> faults = reader.faults();
      if (faults.size() == 1 && faults[0].find(says) != std::string::npos) {
        EXPECT_EQ(faults[0].find("colour and depth: "), 0u) << "one fault per device: " << faults[0];
        return;
      }
    }
    ADD_FAILURE() << "no fault";
  }

  /// Reads frames of a paced device opened less than 256 frames ago. Checks that indices and times increase and that
  /// depth and colour are of the same moment.
  static Summary play(FrameReader& reader, Clock::duration span) {
    Summary out;
    std::optional<FrameSet> last;
    int last_color = -1;
    const Clock::time_point begin = Clock::now();
    Clock::time_point waits_since = begin;
    while (Clock::now() - begin < span) {
      const auto set = reader.next(50ms);
      if (!set) {
        continue;
      }
      out.longest_wait = std::max(out.longest_wait, Clock::now() - waits_since);
      waits_since = Clock::now();
      for (const std::string& warning : set->warnings) {
        out.warnings += warning + '\n';
      }
      const int color = shown(*set->color);
      EXPECT_GT(color, last_color);
      last_color = color;
      if (set->depth) {
        EXPECT_EQ(shown(*set->depth), color % 100) << "depth of another moment";
      }
      EXPECT_LE(set->time_ns, steady_now_ns());
      EXPECT_GT(set->time_ns, steady_now_ns() - 1'000'000'000);
      if (last) {
        EXPECT_GT(set->time_ns, last->time_ns);
        EXPECT_GT(set->index, last->index);
        out.left_out += set->index - last->index - 1;
      }
      ++out.frames;
      out.without_depth += set->depth ? 0 : 1;
      last = set;
    }
    EXPECT_TRUE(reader.faults().empty()) << "none of these faults ends the camera";
    return out;
  }
  Summary play_with(const char* fault) const {
    set("paced");
    set(fault);
    const auto reader = open_frames(session());
    wait_for_frame(*reader);
    return play(*reader, 2s);
  }
};

TEST_F(OpenNiFaults, AbsentAtTheStartThenLive) {
  set("absent");
  const auto reader = open_frames(session());
  wait_for_fault(*reader, "found nothing OpenNI2 can open");
  clear("absent");
  EXPECT_LT(wait_for_frame(*reader), 2s);
}

/// OpenNI2 has no error code for it; the driver's message is passed on.
TEST_F(OpenNiFaults, InUseByAnotherProgramUntilItIsFree) {
  set("in-use");
  const auto reader = open_frames(session());
  wait_for_fault(*reader, "found nothing OpenNI2 can open: ");
  wait_for_fault(*reader, "device is busy");
  clear("in-use");
  EXPECT_LT(wait_for_frame(*reader), 2s);
}

TEST_F(OpenNiFaults, UnpluggedAgainAndAgain) {
  const auto reader = open_frames(session());
  wait_for_frame(*reader);
  test::Leaks leaks;
  for (int cycle = 0; cycle < test::cycles(10); ++cycle) {
    set("absent");
    wait_for_fault(*reader, cycle % 2 == 0 ? "disconnected" : "found nothing");
    clear("absent");
    EXPECT_LT(wait_for_frame(*reader), 2s) << "after it came back";
    leaks.end_of_cycle();
  }
  leaks.expect_none();
}

TEST_F(OpenNiFaults, FrozenWithoutAnError) {
  const auto reader = open_frames(session());
  wait_for_frame(*reader);
  set("frozen");
  wait_for_fault(*reader, "the camera delivers no frames, it is opened again");
  clear("frozen");
  EXPECT_LT(wait_for_frame(*reader), 2s);
}

TEST_F(OpenNiFaults, FramesOfAnotherSize) {
  const auto reader = open_frames(session());
  wait_for_frame(*reader);
  set("resized");
  wait_for_fault(*reader, "delivers no intact frames (the picture has another size or format), it is opened again");
  clear("resized");
  EXPECT_LT(wait_for_frame(*reader), 2s);
}

TEST_F(OpenNiFaults, AnUnsupportedSizeIsRefused) {
  EXPECT_THROW(open_frames(session({"color.width=320"})), InputError);
}

TEST_F(OpenNiFaults, LostFramesAreCounted) {
  const Summary summary = play_with("lossy");
  EXPECT_GT(summary.frames, 30);
  EXPECT_GT(summary.left_out, 4u) << "one of eight";
  EXPECT_TRUE(summary.says("1 colour pictures missing before picture ")) << summary.warnings;
  EXPECT_TRUE(summary.says("1 depth pictures missing before picture ")) << summary.warnings;
}

TEST_F(OpenNiFaults, RepeatedFramesAreDropped) {
  const Summary summary = play_with("repeating");
  EXPECT_GT(summary.frames, 35);
  EXPECT_TRUE(summary.says("is 0 ms older than the one before: dropped")) << summary.warnings;
}

TEST_F(OpenNiFaults, FramesAfterTheirSuccessorsAreDropped) {
  const Summary summary = play_with("swapping");
  EXPECT_GT(summary.frames, 30);
  EXPECT_TRUE(summary.says("is 33 ms older than the one before: dropped")) << summary.warnings;
}

TEST_F(OpenNiFaults, LateDepthHoldsUpNoColour) {
  const Summary summary = play_with("late");
  EXPECT_GT(summary.frames, 45);
  EXPECT_LT(summary.longest_wait, 150ms);
  EXPECT_GT(summary.without_depth, 2);
  EXPECT_TRUE(summary.says("no depth picture within 17 ms of the colour picture")) << summary.warnings;
  EXPECT_TRUE(summary.says("late or without a colour picture: dropped")) << summary.warnings;
}

TEST_F(OpenNiFaults, AClockThatJumpsIsFollowed) {
  set("paced");
  const auto reader = open_frames(session());
  wait_for_frame(*reader);
  EXPECT_GT(play(*reader, 1s).frames, 20);
  set("jumped");
  EXPECT_GT(play(*reader, 1s).frames, 20) << "an hour on";
  clear("jumped");
  EXPECT_GT(play(*reader, 1s).frames, 20) << "and back";
}

/// All cameras of a kiosk: a depth camera and a GigE Vision fish-eye.
class TwoCameras : public OpenNiFaults {
 protected:
  void SetUp() override {
    OpenNiFaults::SetUp();
    set("paced");
    std::ofstream(folder_ / "session.toml", std::ios::app) << R"([fisheye]
source = "aravis:)" << test::GigeCamera::kName << R"("
pixel_format = "grey8"
width = 160
height = 120
f = 40
cx = 79.5
cy = 59.5
fov_degrees = 180
exposure = 2
T_tag_fisheye = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]
)";
  }
  static Clock::duration wait_for_both(FrameReader& reader) {
    const Clock::time_point begin = Clock::now();
    while (Clock::now() - begin < 15s) {
      const auto set = reader.next(100ms);
      if (set && set->depth && !set->fisheye.empty() && reader.faults().empty()) {
        return Clock::now() - begin;
      }
    }
    ADD_FAILURE() << "not both";
    return 15s;
  }
};

TEST_F(TwoCameras, AFaultInOneStopsNotTheOther) {
  auto fisheye = std::make_unique<test::GigeCamera>();
  ASSERT_TRUE(fisheye->running());
  const auto reader = open_frames(session());
  wait_for_both(*reader);

  fisheye.reset();
  Clock::duration longest{};
  Clock::time_point last = Clock::now();
  for (const Clock::time_point begin = last; Clock::now() - begin < 4s;) {
    if (reader->next(50ms)) {
      longest = std::max(longest, Clock::now() - last);
      last = Clock::now();
    }
  }
  EXPECT_LT(longest, 500ms) << "longest pause of colour while the fish-eye was absent";
  ASSERT_EQ(reader->faults().size(), 1u);
  EXPECT_EQ(reader->faults()[0].find("fish-eye: "), 0u) << reader->faults()[0];
  fisheye = std::make_unique<test::GigeCamera>();
  EXPECT_LT(wait_for_both(*reader), 5s);

  set("absent");
  wait_for_fault(*reader, "found nothing");  // the only fault: the fish-eye continues
  clear("absent");
  EXPECT_LT(wait_for_both(*reader), 2s);
}

}  // namespace
}  // namespace lumigraft::capture
