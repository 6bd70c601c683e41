// FrameSets from session files, with each kind of source.
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>

#include "capture/error.h"
#include "capture/session/config.h"
#include "capture/source.h"
#include "capture/sync/pairing_reader.h"
#include "tests/capture/formats/exr_writer.h"
#include "tests/capture/live/openni_test_pictures.h"
#include "tests/capture/live/small_camera.h"
#include "tests/capture/recorded/mkv_writer.h"
#include "tests/capture/scratch_folder.h"

namespace lumigraft::capture {
namespace {

using namespace std::chrono_literals;
using test::kDeviceHeight;
using test::kDeviceWidth;

class OpenFrames : public test::ScratchFolder {
 protected:
  void SetUp() override {
    ScratchFolder::SetUp();
    std::ofstream(folder_ / "session.toml") << R"(format = 1
[color]
source = "mkv:color.mkv"
)" << test::kSmallCamera << R"([depth]
source = "mkv:depth.mkv"
unit_m = 0.001
[fisheye]
source = "images:fisheye.txt"
width = 20
height = 20
f = 6
cx = 9.5
cy = 9.5
fov_degrees = 180
exposure = 6.0
T_tag_fisheye = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]
[tag]
id = 1
size_m = 0.1
)";
    Image<std::uint8_t> rgb(kDeviceWidth, kDeviceHeight, 3, 90);
    Image<std::uint16_t> counts(kDeviceWidth, kDeviceHeight, 1, 1500);
    test::write_color_mkv(folder_ / "color.mkv", "mjpeg", {{0, rgb}, {33, rgb}, {67, rgb}, {100, rgb}});
    test::write_depth_mkv(folder_ / "depth.mkv", {{2, counts}, {35, counts}, {102, counts}});
    test::write_exr(folder_ / "f.exr", Image<float>(20, 20, 3, 5.0f));
    std::ofstream(folder_ / "fisheye.txt") << "0.000 f.exr\n0.1 f.exr\n";
  }

  Session session(const std::vector<std::string>& overrides) const {
    const ConfigTable root = ConfigTable::load(folder_ / "session.toml", overrides);
    Session out = read_session(root);
    root.finish();
    return out;
  }
  std::string error(const std::vector<std::string>& overrides) const {
    try {
      open_frames(session(overrides));
    } catch (const InputError& e) {
      EXPECT_EQ(std::string(e.what()).find('\n'), std::string::npos) << e.what();
      return e.what();
    }
    return "no error";
  }
};

TEST_F(OpenFrames, MatroskaAndImagesTogether) {
  const auto reader = open_frames(session({}));
  EXPECT_FALSE(reader->live());
  for (int pass = 0; pass < 2; ++pass) {
    std::vector<FrameSet> sets;
    while (auto set = reader->next(100ms)) {
      sets.push_back(std::move(*set));
    }
    ASSERT_EQ(sets.size(), 4u);
    for (std::size_t i = 0; i < 4; ++i) {
      EXPECT_EQ(sets[i].index, i);
      EXPECT_EQ(sets[i].color->exposure, 2.0);
      EXPECT_EQ(sets[i].depth != nullptr, i != 2);
      EXPECT_EQ(sets[i].fisheye.size(), i == 0 || i == 3 ? 1u : 0u);
      EXPECT_EQ(sets[i].warnings.size(), i == 2 ? 1u : 0u);
    }
    EXPECT_FLOAT_EQ(sets[0].depth->depth_m.at(10, 10), 1.5f);
    EXPECT_FLOAT_EQ(sets[3].fisheye[0]->radiance.at(3, 3, 1), 5.0f);
    EXPECT_TRUE(reader->finished());
    reader->rewind();
  }
}

TEST_F(OpenFrames, DepthOfAnotherCameraIsRegistered) {
  const auto reader =
      open_frames(session({"depth.registered=false", "depth.fx=130", "depth.fy=130", "depth.cx=79.5", "depth.cy=59.5",
                           "depth.T_color_depth=[[1,0,0,0.1],[0,1,0,0],[0,0,1,0.25],[0,0,0,1]]"}));
  const auto set = reader->next(100ms);
  ASSERT_TRUE(set && set->depth);
  EXPECT_FLOAT_EQ(set->depth->depth_m.at(80, 60), 1.75f);
  EXPECT_EQ(set->depth->depth_m.at(0, 60), 0.0f) << "outside the depth camera's view";
}

TEST_F(OpenFrames, ALiveDevice) {
  Session live = session({"color.source=openni2:", "depth.source=openni2:"});
  live.fisheye.reset();
  const auto reader = open_frames(live);
  EXPECT_TRUE(reader->live());
  int paired = 0;
  for (int i = 0; i < 12; ++i) {
    const auto set = reader->next(2000ms);
    ASSERT_TRUE(set);
    if (set->depth != nullptr) {
      ++paired;
      EXPECT_LE(std::abs(set->depth->stamp.time_ns - set->time_ns), 17'000'000);
      EXPECT_GT(set->depth->depth_m.at(50, 50), 0.5f);
    }
  }
  EXPECT_GE(paired, 6);
}

TEST_F(OpenFrames, ACameraWithAnotherSerialNumberIsRefused) {
  Session live = session({"color.source=openni2:", "depth.source=openni2:", "depth.serial=LG-0042"});
  live.fisheye.reset();
  EXPECT_EQ(live.color.serial, "");
  take_serials(live, open_sources(live));
  EXPECT_EQ(live.color.serial, "LG-0042");
  live.depth->serial = "LG-0043";
  try {
    open_sources(live);
    FAIL() << "not refused";
  } catch (const InputError& e) {
    EXPECT_STREQ(e.what(),
                 "color.source: openni2:: found the camera with the serial number \"LG-0042\", allowed: "
                 "\"LG-0043\", which the session or its calibration is for");
  }
}

TEST_F(OpenFrames, SettingsThatALiveCameraCannotTakeAreRefused) {
  for (const char* setting : {"pixel_format=rgb8", "exposure_us=1000", "controls.a=1"}) {
    const std::string what = error({"color.source=openni2:", std::string("color.") + setting,
                                    "depth.source=openni2:", "fisheye.source=v4l2:/dev/no-such-camera"});
    EXPECT_EQ(what.find("color." + std::string(setting).substr(0, 4)), 0u) << what;
    EXPECT_NE(what.find(": found it with openni2:, allowed: gain, rate_hz, controls.exposure"), std::string::npos)
        << what;
  }
  EXPECT_EQ(error({"color.source=openni2:", "depth.source=openni2:", "fisheye.source=aravis:x",
                   "fisheye.exposure_us=10", "fisheye.bracket_us=[10, 20]"}),
            "fisheye.bracket_us: found it with aravis:, allowed: v4l2:");
}

TEST_F(OpenFrames, AnAbsentCameraIsOpenedLater) {
  Session live = session({"color.source=v4l2:/dev/no-such-camera"});
  live.depth.reset();
  live.fisheye.reset();
  const auto reader = open_frames(live);
  EXPECT_TRUE(reader->live());
  EXPECT_EQ(reader->faults(), std::vector<std::string>{"colour: v4l2:/dev/no-such-camera: found no such camera"});
  live.color.source = "v4l2:/dev/null";
  EXPECT_THROW(open_frames(live), InputError);
}

TEST_F(OpenFrames, ContradictionsAreRefused) {
  EXPECT_NE(error({"color.source=openni2:", "depth.source=aravis:", "fisheye.source=aravis:"})
                .find("depth.source: found \"aravis:\", allowed of devices for depth: openni2:, v4l2:, freenect:"),
            std::string::npos);
  EXPECT_EQ(error({"color.source=v4l2:A", "depth.source=v4l2:A", "depth.registered=true", "fisheye.source=aravis:"}),
            "depth.source: found the colour camera again, allowed: a camera of its own");
  EXPECT_NE(error({"color.source=v4l2:A", "depth.source=v4l2:B", "fisheye.source=aravis:"})
                .find("depth.registered: found nothing, allowed with v4l2: false, or true if the camera itself"),
            std::string::npos);
  EXPECT_NE(error({"color.source=openni2:"}).find("depth.source: found a recording with a device for colour"),
            std::string::npos);
  EXPECT_NE(error({"fisheye.source=openni2:"}).find("fisheye.source: found a device with a recording"),
            std::string::npos);
  EXPECT_NE(error({"color.source=oni:a.oni", "fisheye.source=oni:a.oni"})
                .find("fisheye.source: found the colour camera again"),
            std::string::npos);
  EXPECT_NE(error({"depth.source=images:none.txt"})
                .find("depth.source: " + (folder_ / "none.txt").string() + ": found no readable file"),
            std::string::npos);
  EXPECT_NE(error({"color.source=mkv:none.mkv"})
                .find("color.source: " + (folder_ / "none.mkv").string() + ": found no readable"),
            std::string::npos);
  EXPECT_NE(
      error({"color.source=oni:none.oni"}).find("color.source: " + (folder_ / "none.oni").string() + ": found nothing"),
      std::string::npos);
  EXPECT_NE(error({"color.width=320"})
                .find("color.source: " + (folder_ / "color.mkv").string() + ": found 160x120 pixels, allowed: 320x120"),
            std::string::npos);
  EXPECT_NE(error({"depth.source=mkv:color.mkv"}).find("found codec mjpeg, allowed: ffv1"), std::string::npos);
  EXPECT_NE(error({"color.source=theremin:0"}).find("--set color.source: found \"theremin:0\", allowed in this build"),
            std::string::npos);
  Session other = session({});
  other.color.source = "libcamera:0";
  EXPECT_THROW(open_frames(other), InputError);
}

}  // namespace
}  // namespace lumigraft::capture
