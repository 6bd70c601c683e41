// A GigE Vision camera in a live session: faults of the camera and of the network.
#include <gtest/gtest.h>

#include <cmath>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <optional>

#include "capture/live/aravis/source.h"
#include "capture/session/config.h"
#include "capture/sync/pairing_reader.h"
#include "tests/capture/live/gige_camera.h"
#include "tests/capture/live/leaks.h"
#include "tests/capture/live/small_camera.h"
#include "tests/capture/recorded_frames.h"
#include "tests/capture/scratch_folder.h"

namespace lumigraft::capture {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;
using CameraProcess = test::GigeCamera;

constexpr int kSmallWidth = 160, kSmallHeight = 120;  // of test::kSmallCamera

class LiveAravis : public test::ScratchFolder {
 protected:
  void SetUp() override {
    ScratchFolder::SetUp();
    std::ofstream(folder_ / "session.toml") << R"(format = 1
[color]
source = "aravis:Aravis-Fake-GV77"
)" << test::kSmallCamera << R"(pixel_format = "bayer-rggb8"
exposure_us = 5000
[tag]
id = 1
size_m = 0.1
)";
  }
  Session session(const std::vector<std::string>& overrides = {}) const {
    const ConfigTable root = ConfigTable::load(folder_ / "session.toml", overrides);
    Session read = read_session(root);
    root.finish();
    return read;
  }
  static Clock::duration wait_for_frame(FrameReader& reader) {
    const Clock::time_point begin = Clock::now();
    while (Clock::now() - begin < 15s) {
      if (reader.next(100ms) && reader.faults().empty()) {
        return Clock::now() - begin;
      }
    }
    ADD_FAILURE() << "no frame";
    return 15s;
  }
  static void wait_for_fault(FrameReader& reader, const std::string& says) {
    const Clock::time_point begin = Clock::now();
    std::vector<std::string> faults;
    while (Clock::now() - begin < 10s) {
      reader.next(100ms);
      faults = reader.faults();
      if (faults.size() == 1 && faults[0].find("colour: ") == 0 && faults[0].find(says) != std::string::npos) {
        return;
      }
    }
    ADD_FAILURE() << "no fault \"" << says << "\" but \"" << (faults.empty() ? "" : faults[0]) << '"';
  }
  static constexpr Clock::duration kBackWithin = 5s;
};

TEST_F(LiveAravis, AbsentAtTheStartItIsSearchedFor) {
  CameraProcess::take_loopback();
  std::optional<CameraProcess> camera;
  const auto reader = open_frames(session());
  wait_for_fault(*reader, "found no such camera that answers");
  camera.emplace();
  ASSERT_TRUE(camera->running());
  EXPECT_LT(wait_for_frame(*reader), kBackWithin);
}

TEST_F(LiveAravis, KilledAndRestartedItComesBack) {
  auto camera = std::make_unique<CameraProcess>();
  ASSERT_TRUE(camera->running());
  const auto reader = open_frames(session());
  wait_for_frame(*reader);
  test::Leaks leaks;
  for (int cycle = 0; cycle < test::cycles(2); ++cycle) {
    camera.reset();
    wait_for_fault(*reader, "");
    camera = std::make_unique<CameraProcess>();
    ASSERT_TRUE(camera->running());
    EXPECT_LT(wait_for_frame(*reader), kBackWithin) << "after it came back";
    leaks.end_of_cycle();
  }
  leaks.expect_none();
}

/// As if its cable were unplugged for a while: the camera continues where it was.
TEST_F(LiveAravis, FrozenWithoutAnError) {
  const CameraProcess camera;
  ASSERT_TRUE(camera.running());
  const auto reader = open_frames(session());
  wait_for_frame(*reader);
  camera.signal(SIGSTOP);
  wait_for_fault(*reader, "the camera delivers no frames, it is opened again");
  camera.signal(SIGCONT);
  EXPECT_LT(wait_for_frame(*reader), kBackWithin);
}

/// Faults of the network. Sequence numbers and times increase, and frames are complete.
TEST_F(LiveAravis, FramesRepeatedSwappedLateOrInPieces) {
  constexpr double kPeriod_ms = 1e3 / 30;
  for (const std::string fault : {"repeating", "swapping", "late", "shuffling"}) {
    const CameraProcess camera("0", fault);
    ASSERT_TRUE(camera.running());
    const auto reader =
        open_frames(session({"color.pixel_format=grey8", "color.rate_hz=30", "color.exposure_us=10000"}));
    wait_for_frame(*reader);
    std::optional<FrameSet> last;
    int frames = 0, late = 0;
    std::uint64_t missing = 0;
    std::vector<double> steps_ms;
    for (const Clock::time_point begin = Clock::now(); Clock::now() - begin < 2s;) {
      auto set = reader->next(100ms);
      if (!set) {
        continue;
      }
      EXPECT_TRUE(test::is_ramp(set->color->encoded)) << fault;
      EXPECT_TRUE(reader->faults().empty()) << fault;
      late += set->color->stamp.host_time_ns - set->time_ns > 60'000'000 ? 1 : 0;
      if (last) {
        EXPECT_GT(set->index, last->index) << fault;
        EXPECT_GT(set->time_ns, last->time_ns) << fault;
        missing += set->index - last->index - 1;
        steps_ms.push_back(1e-6 * static_cast<double>(set->time_ns - last->time_ns));
      }
      last = std::move(set);
      ++frames;
    }
    std::printf("%s: %d pictures, %d late, %d missing\n", fault.c_str(), frames, late, static_cast<int>(missing));
    EXPECT_GT(frames, 30) << fault;
    EXPECT_TRUE(fault != "swapping" || missing > 2) << "no frames were missing: nothing was tested";
    EXPECT_TRUE(fault != "late" || late > 2) << "no frames were late: nothing was tested";
    ASSERT_FALSE(steps_ms.empty());
    const auto middle = steps_ms.begin() + static_cast<std::ptrdiff_t>(steps_ms.size() / 2);
    std::nth_element(steps_ms.begin(), middle, steps_ms.end());
    EXPECT_NEAR(*middle, kPeriod_ms, 2.0) << fault << ": period of the frame times, whenever they arrived";
  }
}

TEST_F(LiveAravis, DamagedChunksWarnOnce) {
  const CameraProcess camera("0", "chunks-torn");
  ASSERT_TRUE(camera.running());
  const auto reader = open_frames(session({"color.pixel_format=grey8", "color.exposure_us=10000"}));
  int frames = 0, warnings = 0, kept = 0;
  double last_exposure = 0;
  for (const Clock::time_point begin = Clock::now(); frames < 30 && Clock::now() - begin < 15s;) {
    const auto set = reader->next(100ms);
    if (!set) {
      continue;
    }
    ++frames;
    EXPECT_TRUE(test::is_ramp(set->color->encoded));
    EXPECT_TRUE(reader->faults().empty());
    kept += set->color->exposure == last_exposure ? 1 : 0;
    last_exposure = set->color->exposure;
    warnings += std::count_if(set->warnings.begin(), set->warnings.end(), [](const std::string& warning) {
      return warning.find("colour: the camera's chunks lack") == 0;
    });
  }
  EXPECT_EQ(frames, 30);
  EXPECT_EQ(warnings, 1);
  EXPECT_GE(kept, 3) << "nothing was tested";
}

TEST_F(LiveAravis, ClosesQuicklyAfterItsCameraIsGone) {
  std::optional<CameraProcess> camera(std::in_place);
  ASSERT_TRUE(camera->running());
  auto reader = open_frames(session());
  wait_for_frame(*reader);
  camera.reset();
  const Clock::time_point begin = Clock::now();
  reader.reset();
  EXPECT_LT(Clock::now() - begin, 1s);
}

TEST_F(LiveAravis, InUseByAnotherClient) {
  const CameraProcess camera;
  ASSERT_TRUE(camera.running());
  auto other = std::make_unique<AravisSource>(
      test::GigeCamera::kName, StreamSpec{.stream = Stream::fisheye, .width = kSmallWidth, .height = kSmallHeight});
  ASSERT_TRUE(other->next(3000ms));
  const auto reader = open_frames(session());
  wait_for_fault(*reader, "aravis:Aravis-Fake-GV77: found it in use by another program");
  EXPECT_TRUE(other->next(3000ms)) << "the first client keeps the camera";
  other.reset();
  EXPECT_LT(wait_for_frame(*reader), kBackWithin);
}

TEST_F(LiveAravis, IsRecordedWithoutLoss) {
  const CameraProcess camera;
  ASSERT_TRUE(camera.running());
  test::expect_identical_replay(folder_, 5);
  EXPECT_LT(std::filesystem::file_size(folder_ / "out" / "color.mkv"), 5u * (kSmallWidth * kSmallHeight + 200) + 1000u)
      << "one byte a pixel, as on the wire";
}

}  // namespace
}  // namespace lumigraft::capture
