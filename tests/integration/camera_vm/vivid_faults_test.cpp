// Faults of a V4L2 camera, produced by the kernel's virtual camera vivid.
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <filesystem>
#include <fstream>

#include "capture/error.h"
#include "capture/live/live_source.h"
#include "capture/live/v4l2/source.h"
#include "tests/capture/live/leaks.h"
#include "tests/integration/camera_vm/vivid_camera.h"

namespace lumigraft::capture {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;
using test::kSinglePlanar;
using test::Vivid;
using test::vivid_spec;

std::unique_ptr<LiveSource> live(const std::string& camera = kSinglePlanar, LivePatience patience = {}) {
  const auto open = [camera] { return std::make_unique<V4l2Source>(camera, vivid_spec(PixelFormat::grey8)); };
  return std::make_unique<LiveSource>("fish-eye", open, patience);
}

class VividFaults : public testing::Test {
 protected:
  /// Time until frames arrive again. Checks that sequence numbers and times increase.
  Clock::duration wait_for_frame(LiveSource& source) {
    const Clock::time_point begin = Clock::now();
    while (Clock::now() - begin < 10s) {
      const auto item = source.next(50ms);
      const auto* picture = item ? std::get_if<Frame>(&*item) : nullptr;
      if (picture == nullptr) {
        continue;
      }
      EXPECT_TRUE(!last_ || picture->stamp.sequence > last_->sequence);
      EXPECT_TRUE(!last_ || picture->stamp.time_ns > last_->time_ns);
      EXPECT_LE(picture->stamp.time_ns, picture->stamp.host_time_ns);
      last_ = picture->stamp;
      if (source.fault().empty()) {
        return Clock::now() - begin;
      }
    }
    ADD_FAILURE() << "no picture: " << source.fault();
    return 10s;
  }
  static void wait_for_fault(LiveSource& source, const std::string& says) {
    const Clock::time_point begin = Clock::now();
    while (Clock::now() - begin < 10s) {
      const std::string fault = source.fault();
      if (!fault.empty() && fault.find(says) != std::string::npos) {
        EXPECT_EQ(fault.find("fish-eye: "), 0u) << fault;
        while (source.next(0ms)) {
        }
        return;
      }
      source.next(10ms);
    }
    ADD_FAILURE() << "no fault \"" << says << "\" but \"" << source.fault() << '"';
  }

  std::optional<Stamp> last_;
};

TEST_F(VividFaults, GoneAndBackAgain) {
  const auto source = live();
  wait_for_frame(*source);
  for (int cycle = 0; cycle < 3; ++cycle) {
    {
      const Vivid camera;  // while a handle is open, the camera stays away
      ASSERT_TRUE(camera.set("Disconnect"));
      wait_for_fault(*source, "the camera is disconnected, it is searched for again");
      wait_for_fault(*source, "v4l2:platform:vivid-000: found no such camera");
    }
    EXPECT_LT(wait_for_frame(*source), 2s) << "after it came back";
  }
}

/// A kiosk holds the last frame while its camera is away.
TEST_F(VividFaults, ALentFrameDoesNotKeepTheCameraOpen) {
  const auto open = [] { return std::make_unique<V4l2Source>(kSinglePlanar, vivid_spec(PixelFormat::yuyv)); };
  LiveSource source("fish-eye", open);
  std::vector<Frame> kept;
  std::vector<std::vector<std::uint8_t>> bytes;
  for (int cycle = 0; cycle < 3; ++cycle) {
    wait_for_frame(source);
    const auto item = source.next(1000ms);
    ASSERT_TRUE(item && std::holds_alternative<Frame>(*item));
    kept.push_back(std::get<Frame>(*item));
    bytes.emplace_back(kept.back().original->bytes.begin(), kept.back().original->bytes.end());
    ASSERT_TRUE(Vivid().set("Disconnect"));
    wait_for_fault(source, "disconnected");
    EXPECT_LT(wait_for_frame(source), 2s);
  }
  for (std::size_t i = 0; i < kept.size(); ++i) {
    EXPECT_TRUE(std::ranges::equal(kept[i].original->bytes, bytes[i]));
  }
}

std::size_t mappings() {
  std::ifstream maps("/proc/self/maps");
  std::size_t count = 0;
  for (std::string line; std::getline(maps, line);) {
    count += line.find("/dev/video") != std::string::npos ? 1 : 0;
  }
  return count;
}

TEST_F(VividFaults, AHundredTimesGoneNothingLeaks) {
  const auto source = live(kSinglePlanar, {2000ms, 10ms});
  wait_for_frame(*source);
  const std::size_t mapped = mappings();
  test::Leaks leaks;
  for (int cycle = 0; cycle < 100; ++cycle) {
    ASSERT_TRUE(Vivid().set("Disconnect"));
    wait_for_fault(*source, "");
    wait_for_frame(*source);
    ASSERT_FALSE(HasFailure()) << "cycle " << cycle;
    leaks.end_of_cycle();
  }
  leaks.expect_none();
  EXPECT_EQ(mappings(), mapped);
}

TEST_F(VividFaults, AbsentAtTheStartItIsSearchedFor) {
  std::unique_ptr<LiveSource> source;
  {
    const Vivid camera;
    ASSERT_TRUE(camera.set("Disconnect"));
    source = live();
    wait_for_fault(*source, "found no such camera");
  }
  EXPECT_LT(wait_for_frame(*source), 2s);
}

TEST_F(VividFaults, AnErrorOfTheStream) {
  const auto source = live();
  wait_for_frame(*source);
  ASSERT_TRUE(Vivid().set("Inject Fatal Streaming Error"));
  wait_for_fault(*source, "the camera stopped: Input/output error, it is searched for again");
  EXPECT_LT(wait_for_frame(*source), 2s);
}

TEST_F(VividFaults, AStreamThatDoesNotStart) {
  for (const auto& [control, says] :
       {std::pair("Inject VIDIOC_STREAMON Error", "start: "), std::pair("Inject VIDIOC_REQBUFS Error", "buffers: ")}) {
    const Vivid camera;
    ASSERT_TRUE(camera.set(control)) << control;
    const auto source = live();
    wait_for_fault(*source, says);
    last_.reset();  // from another source
    EXPECT_LT(wait_for_frame(*source), 2s);
  }
}

TEST_F(VividFaults, FrozenWithoutAnError) {
  const auto source = live();
  wait_for_frame(*source);
  {
    const Vivid camera;
    ASSERT_TRUE(camera.set("Percentage of Dropped Buffers", 100));
    wait_for_fault(*source, "the camera delivers no frames, it is opened again");
    ASSERT_TRUE(camera.set("Percentage of Dropped Buffers", 0));
  }
  EXPECT_LT(wait_for_frame(*source), 2s);
}

TEST_F(VividFaults, LostFramesAreCounted) {
  StreamSpec spec = vivid_spec(PixelFormat::grey8);
  spec.settings.rate_hz = 25.0;
  V4l2Source source(kSinglePlanar, spec);
  const Vivid camera;
  ASSERT_TRUE(camera.set("Percentage of Dropped Buffers", 50));
  std::optional<Stamp> first, last;
  for (int i = 0; i < 30; ++i) {
    const auto item = source.next(3000ms);
    ASSERT_TRUE(item && std::holds_alternative<Frame>(*item));
    last = stamp_of(*item);
    first = first.value_or(*last);
  }
  ASSERT_TRUE(camera.set("Percentage of Dropped Buffers", 0));
  const auto steps = static_cast<double>(last->sequence - first->sequence);
  EXPECT_GT(steps, 40) << "half of them are missing";
  EXPECT_NEAR(static_cast<double>(last->time_ns - first->time_ns) * 1e-6 / steps, 40.0, 4.0) << "ms between numbers";
}

TEST_F(VividFaults, NumbersThatWrapGoOn) {
  ASSERT_TRUE(Vivid().set("Wrap Sequence Number", 1));
  V4l2Source source(kSinglePlanar, vivid_spec(PixelFormat::grey8));
  std::optional<std::uint64_t> last;
  std::uint64_t missing = 0;
  for (int i = 0; i < 160; ++i) {  // it wraps after 128
    const auto item = source.next(3000ms);
    ASSERT_TRUE(item);
    const std::uint64_t sequence = stamp_of(*item).sequence;
    ASSERT_TRUE(!last || sequence > *last);
    missing += last ? sequence - *last - 1 : 0;
    last = sequence;
  }
  EXPECT_LT(missing, 40u);
  EXPECT_TRUE(Vivid().set("Wrap Sequence Number", 0));
}

TEST_F(VividFaults, AnotherMeaningOfColours) {
  const auto open = [] { return std::make_unique<V4l2Source>(kSinglePlanar, vivid_spec(PixelFormat::yuyv)); };
  LiveSource source("fish-eye", open);
  wait_for_frame(source);
  {
    const Vivid camera;
    ASSERT_TRUE(camera.set("Y'CbCr Encoding", 2));  // menu entry: BT.709
    wait_for_fault(source, "the camera gives another format now, it is searched for again");
    wait_for_fault(source, "found yuyv of another kind than BT.601 from 16 to 235, allowed: pixel_format rgb8");
    ASSERT_TRUE(camera.set("Y'CbCr Encoding", 0));
  }
  EXPECT_LT(wait_for_frame(source), 2s);
  ASSERT_TRUE(Vivid().set("Quantization", 1));
  wait_for_fault(source, "found yuyv of another kind");
  ASSERT_TRUE(Vivid().set("Quantization", 0));
  EXPECT_LT(wait_for_frame(source), 2s);
}

/// A camera is free again after the program that used it was killed.
TEST_F(VividFaults, InUseByAnotherProgramUntilThatIsKilled) {
  int ends[2];
  ASSERT_EQ(pipe(ends), 0);
  const pid_t other = fork();
  ASSERT_GE(other, 0);
  if (other == 0) {
    V4l2Source camera(kSinglePlanar, vivid_spec(PixelFormat::grey8));
    for (char one = 1; camera.next(3000ms) && write(ends[1], &one, 1) == 1;) {
    }
    _exit(1);
  }
  char streams = 0;
  ASSERT_EQ(read(ends[0], &streams, 1), 1);
  const auto source = live();
  wait_for_fault(*source, "v4l2:platform:vivid-000: found it in use by another program");
  kill(other, SIGKILL);
  EXPECT_LT(wait_for_frame(*source), 2s);
  waitpid(other, nullptr, 0);
  close(ends[0]);
  close(ends[1]);
}

TEST_F(VividFaults, WithoutPermission) {
  ASSERT_EQ(chmod("/dev/video0", 0600), 0);
  ASSERT_EQ(seteuid(65534), 0);
  std::string said;
  try {
    V4l2Source source("/dev/video0", vivid_spec(PixelFormat::grey8));
  } catch (const CameraFault& e) {
    said = e.what();
  }
  ASSERT_EQ(seteuid(0), 0);
  EXPECT_EQ(said, "v4l2:/dev/video0: found no permission to use it, allowed: root and members of the group video");
}

/// Unbinds and binds the driver, which removes and creates the node as unplugging does.
TEST_F(VividFaults, UnpluggedAndReplugged) {
  const auto write = [](const char* file) {
    std::ofstream(std::string("/sys/bus/platform/drivers/vivid/") + file) << "vivid.0";
  };
  const auto source = live();
  wait_for_frame(*source);
  for (int cycle = 0; cycle < 2; ++cycle) {
    write("unbind");
    EXPECT_FALSE(std::filesystem::exists("/dev/video0"));
    wait_for_fault(*source, "found no such camera");
    write("bind");
    EXPECT_LT(wait_for_frame(*source), 3s);
  }
}

}  // namespace
}  // namespace lumigraft::capture
