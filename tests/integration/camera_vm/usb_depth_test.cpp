// A depth camera of USB Video Class: the kernel's uvcvideo driver with the camera of usb_camera.cpp, which gives Z16.
#include "tests/integration/camera_vm/usb_depth.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>

#include "capture/error.h"
#include "capture/live/camera_list.h"
#include "capture/live/live_source.h"
#include "capture/live/v4l2/source.h"
#include "capture/record/session_recorder.h"
#include "capture/session/config.h"
#include "capture/sync/pairing_reader.h"
#include "tests/capture/scratch_folder.h"
#include "tests/integration/camera_vm/usb_plug.h"
#include "tests/integration/camera_vm/vivid_camera.h"

namespace lumigraft::capture {
namespace {

using namespace std::chrono_literals;
using test::UsbPlug;
constexpr const char* kDepthCamera = UsbPlug::kName;

class DepthPlug : public UsbPlug {
 public:
  DepthPlug() : UsbPlug(known_to_the_kernel, {"depth"}) {}
};

StreamSpec depth_spec() { return {.stream = Stream::depth, .width = UsbPlug::kWidth, .height = UsbPlug::kHeight}; }

std::optional<RawDepth> next_depth(Source& source) {
  const auto item = source.next(3s);
  const auto* depth = item ? std::get_if<RawDepth>(&*item) : nullptr;
  return depth != nullptr ? std::optional(*depth) : std::nullopt;
}

void expect_counts(const RawDepth& depth) {
  ASSERT_EQ(depth.counts.width, UsbPlug::kWidth);
  ASSERT_EQ(depth.counts.height, UsbPlug::kHeight);
  EXPECT_EQ(depth.counts.data, test::depth_counts(UsbPlug::kWidth, UsbPlug::kHeight, depth.counts.data[0]));
}

std::string refusal(const StreamSpec& spec) {
  try {
    const V4l2Source source(kDepthCamera, spec);
  } catch (const InputError& e) {
    return e.what();
  }
  return "no error";
}

TEST(UsbDepth, IsListedAndEveryCountArrives) {
  const DepthPlug camera;
  const std::vector<CameraListing> all = list_v4l2_cameras();
  const auto listed =
      std::ranges::find_if(all, [](const CameraListing& c) { return c.name.starts_with(kDepthCamera); });
  ASSERT_NE(listed, all.end());
  ASSERT_EQ(listed->formats.size(), 1u);
  EXPECT_EQ(listed->formats[0].pixels, "z16");
  EXPECT_EQ(listed->formats[0].width, UsbPlug::kWidth);
  EXPECT_NEAR(listed->formats[0].rate_hz, 20.0, 0.01);
  V4l2Source source(kDepthCamera, depth_spec());
  std::optional<std::uint64_t> last;
  for (int i = 0; i < 12; ++i) {
    const auto depth = next_depth(source);
    ASSERT_TRUE(depth) << source.fault();
    expect_counts(*depth);
    EXPECT_TRUE(!last || depth->stamp.sequence > *last);
    last = depth->stamp.sequence;
  }
  EXPECT_TRUE(source.on_host_clock());
}

TEST(UsbDepth, GoesOnAdaptingItselfUnlessItsExposureIsStated) {
  const DepthPlug camera;
  const auto mode = [] {
    for (const CameraListing& one : list_v4l2_cameras()) {
      for (const OfferedControl& control : one.controls) {
        if (one.name.starts_with(kDepthCamera) && control.name == "auto_exposure") return control.value;
      }
    }
    return -1.0;
  };
  constexpr double kManual = 1, kAutomatic = 3;  // V4L2_EXPOSURE_MANUAL, V4L2_EXPOSURE_APERTURE_PRIORITY
  StreamSpec spec = depth_spec();
  { const V4l2Source source(kDepthCamera, spec); }
  EXPECT_EQ(mode(), kAutomatic);
  spec.settings.exposure_us = 5'000;
  { const V4l2Source source(kDepthCamera, spec); }
  EXPECT_EQ(mode(), kManual);
}

TEST(UsbDepth, IsNoColourCameraAndHasNoOtherFormat) {
  const DepthPlug camera;
  StreamSpec spec = depth_spec();
  spec.settings.pixel_format = PixelFormat::grey16;
  EXPECT_EQ(refusal(spec), "v4l2:Test Camera: found no pixel format grey16 for 160x120 pixels, offered: z16");
  spec.settings.pixel_format.reset();
  spec.stream = Stream::color;
  EXPECT_EQ(refusal(spec),
            "v4l2:Test Camera: found no pictures of 160x120 pixels, allowed: what `lumigraft devices` "
            "lists");
}

TEST(UsbDepth, Grey16IsDepthIfTheConfigurationSaysSo) {
  StreamSpec spec = test::vivid_spec(PixelFormat::grey16);
  spec.stream = Stream::depth;
  V4l2Source source(test::kSinglePlanar, spec);
  const auto depth = next_depth(source);
  ASSERT_TRUE(depth);
  EXPECT_EQ(depth->counts.at(2, 2) >> 8, depth->counts.at(20, 100) >> 8) << "one bar";
  EXPECT_GT(depth->counts.at(2, 2), depth->counts.at(test::kVividWidth - 2, 2)) << "white before black";
  spec.settings.pixel_format.reset();
  try {
    const V4l2Source other(test::kSinglePlanar, spec);
    FAIL() << "not refused";
  } catch (const InputError& e) {
    EXPECT_NE(std::string(e.what()).find("found no pixel format z16 for 320x180 pixels, offered:"), std::string::npos);
  }
}

// The kernel's driver drops a frame with too few bytes by itself, but numbers it.
TEST(UsbDepth, ATornFrameIsALostNumberAndTheOthersAreComplete) {
  const DepthPlug camera;
  V4l2Source source(kDepthCamera, depth_spec());
  const auto first = next_depth(source);
  ASSERT_TRUE(first);
  camera.signal(SIGUSR1);
  std::uint64_t last = first->stamp.sequence;
  bool gap = false;
  for (int i = 0; i < 20; ++i) {
    const auto depth = next_depth(source);
    ASSERT_TRUE(depth);
    expect_counts(*depth);
    gap = gap || depth->stamp.sequence > last + 1;
    last = depth->stamp.sequence;
  }
  EXPECT_TRUE(gap);
}

TEST(UsbDepth, UnpluggedAndReplugged) {
  auto camera = std::make_unique<DepthPlug>();
  LiveSource source("depth", [] { return std::make_unique<V4l2Source>(kDepthCamera, depth_spec()); });
  ASSERT_TRUE(next_depth(source));
  camera.reset();
  const auto begin = std::chrono::steady_clock::now();
  while (source.fault() != "depth: v4l2:Test Camera: found no such camera" &&
         std::chrono::steady_clock::now() - begin < 10s) {
    source.next(20ms);
  }
  EXPECT_EQ(source.fault(), "depth: v4l2:Test Camera: found no such camera");
  while (source.next(0ms)) {
  }
  camera = std::make_unique<DepthPlug>();
  const auto depth = next_depth(source);
  ASSERT_TRUE(depth);
  expect_counts(*depth);
}

class RecordedUsbDepth : public test::ScratchFolder {};

TEST_F(RecordedUsbDepth, ReplaysEveryCountAndIsRegisteredToTheColourCamera) {
  const DepthPlug camera;
  std::ofstream(folder_ / "session.toml") << R"(format = 1
[color]
source = "v4l2:platform:vivid-000"
width = 320
height = 180
fx = 240
fy = 240
cx = 159.5
cy = 89.5
exposure = 2
[depth]
source = "v4l2:Test Camera"
unit_m = 0.0001
registered = false
width = 160
height = 120
fx = 110
fy = 110
cx = 79.5
cy = 59.5
T_color_depth = [[1, 0, 0, 0.05], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]
rate_hz = 20
[tag]
id = 1
size_m = 0.1
)";
  const auto read = [](const std::filesystem::path& file) {
    const ConfigTable root = ConfigTable::load(file);
    Session out = read_session(root);
    root.finish();
    return out;
  };
  const Session live = read(folder_ / "session.toml");
  std::vector<RawDepth> seen;
  {
    const PairedSources sources = open_sources(live);
    SessionRecorder recorder({folder_ / "session.toml", {}}, live, folder_ / "out");
    while (seen.size() < 8) {
      const auto color = sources.color->next(3s), depth = sources.depth->next(3s);
      ASSERT_TRUE(color && depth);
      recorder.write(Stream::color, *color);
      if (recorder.write(Stream::depth, *depth)) seen.push_back(std::get<RawDepth>(*depth));
    }
  }
  const Session recorded = read(folder_ / "out" / "session.toml");
  const PairedSources replay = open_sources(recorded);
  for (const RawDepth& before : seen) {
    expect_counts(before);
    const auto after = next_depth(*replay.depth);
    ASSERT_TRUE(after);
    EXPECT_EQ(after->stamp.time_ns, before.stamp.time_ns);
    EXPECT_EQ(after->counts.data, before.counts.data);
  }
  const auto reader = open_frames(recorded);
  bool registered = false;
  while (const auto set = reader->next(0ms)) {
    registered = registered || (set->depth && set->depth->depth_m.width == 320 &&
                                std::ranges::any_of(set->depth->depth_m.data, [](float z) { return z > 0.1f; }));
  }
  EXPECT_TRUE(registered);
}

}  // namespace
}  // namespace lumigraft::capture
