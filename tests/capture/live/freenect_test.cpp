// The helper program of freenect: with libfreenect, which finds no camera here, and with libfakenect, which plays a
// recording of one (FAKENECT_PATH: a folder of files named TYPE-TIME-TICKS.EXTENSION and their list).
#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>

#include "capture/error.h"
#include "capture/live/camera_list.h"
#include "capture/live/helper_source.h"
#include "capture/message_text.h"
#include "tests/capture/scratch_folder.h"

namespace lumigraft::capture {
namespace {

using namespace std::chrono_literals;
constexpr int kKinectWidth = 640, kKinectHeight = 480;
constexpr char kFakeSerial[] = "A00000000000000A";
constexpr std::uint32_t kTicksPerFrame = 2'000'000;  // 60 MHz, 30 Hz

std::vector<StreamSpec> kinect_streams() {
  StreamSpec color{.stream = Stream::color, .width = kKinectWidth, .height = kKinectHeight, .exposure = 2.0};
  StreamSpec depth = color;
  depth.stream = Stream::depth;
  return {color, depth};
}

std::string freenect_error(const std::string& serial, const std::vector<StreamSpec>& specs) {
  try {
    const HelperSource source("lumigraft_freenect", {serial}, specs);
  } catch (const CameraFault& e) {
    return std::string("fault: ") + e.what();
  } catch (const InputError& e) {
    return std::string("error: ") + e.what();
  }
  return "no error";
}

TEST(Freenect, WithoutACameraItSaysSo) {
  const std::string found = freenect_error("", kinect_streams());
  EXPECT_TRUE(found == "fault: found no such camera" || found == "fault: libfreenect does not start: found no USB")
      << found;
}

TEST(Freenect, WhatTheCameraDoesNotGiveIsRefused) {
  std::vector<StreamSpec> specs = kinect_streams();
  specs[0].width = 1280;
  EXPECT_EQ(freenect_error("", specs), "error: found 1280x480 pixels, allowed: 640x480 pixels");
  specs = kinect_streams();
  specs[1].unit_m = 0.0001;
  EXPECT_EQ(freenect_error("", specs), "error: found unit_m = 0.000100, allowed: 0.001");
}

class Fakenect : public test::ScratchFolder {
 protected:
  void SetUp() override {
    ScratchFolder::SetUp();
    setenv("LD_PRELOAD", LUMIGRAFT_FAKENECT, 1);
    setenv("FAKENECT_PATH", folder_.c_str(), 1);
    setenv("LUMIGRAFT_FAKENECT_FLAGS", (folder_ / "flags").c_str(), 1);
  }
  void TearDown() override {
    for (const char* name : {"LD_PRELOAD", "FAKENECT_PATH", "LUMIGRAFT_FAKENECT_FLAGS"}) unsetenv(name);
    ScratchFolder::TearDown();
  }

  static std::uint8_t color_of(std::size_t i, int number) {
    return static_cast<std::uint8_t>(i * 7 + static_cast<std::size_t>(number));
  }
  static std::uint16_t depth_of(std::size_t i, int number) {
    return static_cast<std::uint16_t>(i % 9001 + static_cast<std::size_t>(number));
  }

  /// A recording of `frames` frames of each stream, from just before the camera's clock wraps, without number 3.
  void write_dump(int frames) const {
    std::ofstream list(folder_ / "INDEX.txt");
    for (int number = 0; number < frames; ++number) {
      if (number == 3) continue;
      const std::uint32_t ticks = 0u - kTicksPerFrame + static_cast<std::uint32_t>(number) * kTicksPerFrame;
      const double time_s = 1000.0 + 0.005 * number;
      const std::string color = formatted("r-%f-%u.ppm", time_s, ticks),
                        depth = formatted("d-%f-%u.pgm", time_s, ticks);
      list << color << '\n' << depth << '\n';
      std::string bytes(std::size_t{3} * kKinectWidth * kKinectHeight, '\0');
      for (std::size_t i = 0; i < bytes.size(); ++i) bytes[i] = static_cast<char>(color_of(i, number));
      std::ofstream(folder_ / color, std::ios::binary) << "P6 640 480 255 \n" << bytes;
      bytes.resize(std::size_t{2} * kKinectWidth * kKinectHeight);
      for (std::size_t i = 0; i < bytes.size() / 2; ++i) {
        bytes[2 * i] = static_cast<char>(depth_of(i, number));
        bytes[2 * i + 1] = static_cast<char>(depth_of(i, number) >> 8);
      }
      std::ofstream(folder_ / depth, std::ios::binary) << "P5 640 480 65535 \n" << bytes;
    }
  }
};

TEST_F(Fakenect, EveryFrameArrivesWithTheCamerasTimeAndTheEndIsAFault) {
  write_dump(6);
  HelperSource source("lumigraft_freenect", {""}, kinect_streams());
  EXPECT_EQ(source.serial(), kFakeSerial);
  for (const int number : {0, 1, 2, 4, 5}) {
    const auto first = source.next(5s), second = source.next(5s);
    ASSERT_TRUE(first && second) << source.fault();
    const auto& color = std::get<Frame>(*first);
    const auto& depth = std::get<RawDepth>(*second);
    for (const Stamp& stamp : {color.stamp, depth.stamp}) {
      EXPECT_EQ(stamp.sequence, static_cast<std::uint64_t>(number)) << "a gap for the lost frame";
      EXPECT_NEAR(static_cast<double>(stamp.time_ns), number * 1e9 / 30.0, 2.0) << "across the wrap of the clock";
    }
    EXPECT_EQ(color.exposure, 2.0);
    for (std::size_t i = 0; i < color.encoded.data.size(); ++i) ASSERT_EQ(color.encoded.data[i], color_of(i, number));
    for (std::size_t i = 0; i < depth.counts.data.size(); ++i) ASSERT_EQ(depth.counts.data[i], depth_of(i, number));
  }
  EXPECT_FALSE(source.next(5s));
  EXPECT_EQ(source.fault(), "its helper ended: the camera is disconnected");
}

TEST_F(Fakenect, AutomaticExposureIsHeldAfterTwoSeconds) {
  write_dump(64);
  {
    HelperSource source("lumigraft_freenect", {kFakeSerial}, {kinect_streams()[0]});
    while (!source.finished()) source.next(5s);
  }
  std::ifstream file(folder_ / "flags");
  const std::string flags{std::istreambuf_iterator<char>(file), {}};
  EXPECT_EQ(flags, "16384 1\n2 1\n16384 0\n2 0\n") << "FREENECT_AUTO_EXPOSURE, FREENECT_AUTO_WHITE_BALANCE";
}

TEST_F(Fakenect, IsListedAndFoundByItsSerialNumber) {
  write_dump(1);
  const std::vector<CameraListing> all = list_freenect_cameras();
  ASSERT_EQ(all.size(), 1u);
  EXPECT_EQ(all[0].source, std::string("freenect:") + kFakeSerial);
  EXPECT_EQ(freenect_error("B0", kinect_streams()), "fault: found no such camera");
  std::vector<StreamSpec> specs = kinect_streams();
  specs[0].serial = "B0";
  EXPECT_EQ(
      freenect_error("", specs),
      "error: found the camera with the serial number \"A00000000000000A\", allowed: \"B0\", which the session or "
      "its calibration is for");
}

}  // namespace
}  // namespace lumigraft::capture
