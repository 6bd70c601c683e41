// libcamera with the kernel's virtual image processor (vimc) and with a webcam on an emulated USB port.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "capture/error.h"
#include "capture/live/camera_list.h"
#include "capture/live/libcamera/source.h"
#include "capture/live/live_source.h"
#include "tests/capture/live/leaks.h"
#include "tests/capture/recorded_frames.h"
#include "tests/capture/scratch_folder.h"
#include "tests/integration/camera_vm/back_again.h"
#include "tests/integration/camera_vm/driver_memory.h"
#include "tests/integration/camera_vm/usb_plug.h"
#include "tests/integration/camera_vm/vivid_camera.h"

namespace lumigraft::capture {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;
using test::frame_of;
using test::k75;
using test::kBars;
using test::usb_spec;
constexpr int kWidth = 576;  // a multiple of 6, as vimc requires, whose rows need no padding to 64 bytes
constexpr int kHeight = 480;
constexpr int kBelowItsText = 460;
constexpr char kVimc[] = "platform/vimc.0 Sensor B";

StreamSpec vimc_spec(PixelFormat format) {
  StreamSpec spec{.stream = Stream::fisheye, .width = kWidth, .height = kHeight, .exposure = 2.5};
  spec.settings.pixel_format = format;
  return spec;
}

std::optional<CameraListing> listed(const std::string& name) {
  for (const CameraListing& one : list_libcamera_cameras()) {
    if (one.source == "libcamera:" + name || one.name.rfind(name, 0) == 0) {
      return one;
    }
  }
  return std::nullopt;
}

std::string error(const std::string& camera, const StreamSpec& spec) {
  try {
    const LibcameraSource source(camera, spec);
  } catch (const CameraFault& e) {
    return std::string("fault: ") + e.what();
  } catch (const InputError& e) {
    return std::string("error: ") + e.what();
  }
  return "no error";
}

/// Allowed time until frames arrive: one failed start of libcamera's process, the pause after it, and one start that
/// finds the camera. A start takes a second in the virtual machine, or several on a busy host, so it is measured.
std::chrono::nanoseconds back_within() {
  const Clock::time_point begin = Clock::now();
  list_libcamera_cameras();
  const Clock::duration start = Clock::now() - begin;
  std::printf("libcamera's process starts in %.2f s\n", 1e-9 * static_cast<double>(start.count()));
  return std::max<std::chrono::nanoseconds>(test::kBackWithin, 2 * start + LivePatience().retry);
}

class Vimc : public test::ScratchFolder {
 protected:
  void SetUp() override {
    if (!std::filesystem::exists("/sys/module/vimc")) {
      GTEST_SKIP() << "the kernel's vimc could not be built";
    }
    test::ScratchFolder::SetUp();
  }
};

void expect_vimc_bars(const Frame& picture, int brighter = 0) {
  ASSERT_EQ(picture.encoded.width, kWidth);
  ASSERT_EQ(picture.encoded.height, kHeight);
  for (int bar = 0; bar < 8; ++bar) {
    for (int c = 0; c < 3; ++c) {
      const int wanted = kBars[static_cast<std::size_t>(bar)][static_cast<std::size_t>(c)] + brighter;
      EXPECT_NEAR(picture.encoded.at((2 * bar + 1) * kWidth / 16, kBelowItsText, c), std::clamp(wanted, 0, 255), 3)
          << "bar " << bar << ", channel " << c;
    }
  }
}

TEST_F(Vimc, RgbAndBgrGiveTheSameImage) {
  for (const PixelFormat format : {PixelFormat::rgb8, PixelFormat::bgr8}) {
    LibcameraSource source(kVimc, vimc_spec(format));
    const auto picture = frame_of(source);
    ASSERT_TRUE(picture);
    EXPECT_EQ(picture->stream, Stream::fisheye);
    EXPECT_EQ(picture->exposure, 2.5);
    expect_vimc_bars(*picture);
    ASSERT_EQ(picture->original == nullptr, format == PixelFormat::rgb8);
    EXPECT_TRUE(!picture->original || picture->original->format == format);
  }
}

TEST_F(Vimc, RowPaddingIsRemoved) {
  StreamSpec spec = vimc_spec(PixelFormat::bgr8);
  spec.width = 636;
  LibcameraSource source(kVimc, spec);
  const auto picture = frame_of(source);
  ASSERT_TRUE(picture && picture->original);
  EXPECT_EQ(picture->original->bytes.size(), std::size_t{3} * 636 * kHeight);
  EXPECT_NEAR(picture->encoded.at(20, kBelowItsText, 2), k75, 3) << "white";
  EXPECT_NEAR(picture->encoded.at(620, kBelowItsText, 2), 0, 3) << "black";
  EXPECT_NEAR(picture->encoded.at(20, kBelowItsText + 15, 2), k75, 3);
}

TEST_F(Vimc, SequenceAndHostTimesIncrease) {
  LibcameraSource source("Sensor B", vimc_spec(PixelFormat::rgb8));
  EXPECT_TRUE(source.on_host_clock());
  Stamp last;
  for (int i = 0; i < 20; ++i) {
    const auto picture = frame_of(source);
    ASSERT_TRUE(picture);
    const Stamp& stamp = picture->stamp;
    EXPECT_GT(stamp.host_time_ns, stamp.time_ns);
    EXPECT_LT(stamp.host_time_ns - stamp.time_ns, 300'000'000);
    EXPECT_TRUE(i == 0 || (stamp.time_ns > last.time_ns && stamp.sequence > last.sequence));
    last = stamp;
  }
}

TEST_F(Vimc, ASettingIsApplied) {
  StreamSpec spec = vimc_spec(PixelFormat::rgb8);
  for (const double brightness : {0.25, 0.0}) {  // of [-1, 1]: 0.25 is 32 of 256
    spec.settings.controls = {{"Brightness", brightness}};
    LibcameraSource source(kVimc, spec);
    const auto picture = frame_of(source, 10);
    ASSERT_TRUE(picture);
    expect_vimc_bars(*picture, static_cast<int>(std::lround(128 * brightness)));
  }
}

TEST_F(Vimc, WhatItDoesNotOfferIsRefusedAndSaid) {
  const std::string begin = "error: libcamera:" + std::string(kVimc) + ": ";
  const auto with = [](auto change) {
    StreamSpec spec = vimc_spec(PixelFormat::rgb8);
    change(spec);
    return error(kVimc, spec);
  };
  EXPECT_EQ(with([](StreamSpec& s) { s.width = 580; }),
            begin + "found a camera that gives 576x480-BGR888, allowed by the session: 580x480 pixels, rgb8");
  EXPECT_EQ(with([](StreamSpec& s) { s.settings.pixel_format = PixelFormat::nv12; }),
            begin + "found no pixel format nv12, offered: rgb8 bgr8");
  EXPECT_EQ(with([](StreamSpec& s) { s.settings.exposure_us = 100; }),
            begin +
                "exposure_us: found no such number among the camera's controls, allowed: what `lumigraft devices` "
                "lists");
  EXPECT_EQ(with([](StreamSpec& s) { s.settings.rate_hz = 20; }),
            begin + "rate_hz: found a camera whose rate is not set this way");
  EXPECT_EQ(with([](StreamSpec& s) {
              s.settings.controls = {{"Brightness", 7}};
            }),
            begin + "controls.Brightness: found 7.000000, allowed: -1.000000 to 1.000000");
  EXPECT_EQ(error("No Such Camera", vimc_spec(PixelFormat::rgb8)),
            "fault: libcamera:No Such Camera: found no such camera, or another program has it");
  const LibcameraSource first(kVimc, vimc_spec(PixelFormat::rgb8));
  EXPECT_EQ(error(kVimc, vimc_spec(PixelFormat::rgb8)),
            "fault: libcamera:" + std::string(kVimc) + ": found no such camera, or another program has it");
}

TEST_F(Vimc, WithoutPermission) {
  constexpr uid_t kNobody = 65534;
  ASSERT_EQ(seteuid(kNobody), 0);
  const std::string said = error(kVimc, vimc_spec(PixelFormat::rgb8));
  ASSERT_EQ(seteuid(0), 0);
  EXPECT_EQ(said, "fault: libcamera:" + std::string(kVimc) +
                      ": found no permission to use all cameras, allowed: root and members of the group video");
}

TEST_F(Vimc, IsListedCompletely) {
  const auto listing = listed(kVimc);
  ASSERT_TRUE(listing);
  EXPECT_EQ(listing->name, "Sensor B");
  ASSERT_EQ(listing->formats.size(), 4u) << "smallest and largest size of both formats";
  EXPECT_EQ(listing->formats[1].pixels, "rgb8");
  EXPECT_EQ(listing->formats[1].width, 4096);
  EXPECT_TRUE(std::any_of(listing->controls.begin(), listing->controls.end(), [](const OfferedControl& c) {
    return c.name == "Brightness" && c.low == -1.0 && c.high == 1.0 && c.value == 0.0;
  }));
}

TEST_F(Vimc, GoneAndBackAgain) {
  LiveSource source("fish-eye", [] { return std::make_unique<LibcameraSource>(kVimc, vimc_spec(PixelFormat::rgb8)); });
  const auto tell = [](const char* what) {
    std::ofstream(std::string("/sys/bus/platform/drivers/vimc/") + what) << "vimc.0";
  };
  test::expect_back_again(
      source, 2, "fish-eye: libcamera:" + std::string(kVimc) + ": found no such camera, or another program has it",
      [&] { tell("unbind"); },
      [&] {
        tell("bind");
        EXPECT_EQ(std::system("udevadm settle -t 20"), 0)
            << "the camera is complete when udev has announced all its parts";
      },
      back_within);
}

TEST_F(Vimc, FramesAreNotCopiedAndStayValid) {
  auto source = std::make_unique<LibcameraSource>(kVimc, vimc_spec(PixelFormat::bgr8));
  std::vector<Frame> held;
  int of_the_driver = 0;
  for (int i = 0; i < 12; ++i) {  // more frames than there are buffers
    auto picture = frame_of(*source);
    ASSERT_TRUE(picture && picture->original);
    of_the_driver += test::lies_in(picture->original->bytes, "dmabuf") ? 1 : 0;
    held.push_back(std::move(*picture));
  }
  EXPECT_EQ(of_the_driver, 2) << "half of the four buffers stay with the driver, other frames are copied";
  source.reset();
  PixelConverter converter;
  for (const Frame& one : held) {
    EXPECT_EQ(converter.to_rgb(PixelFormat::bgr8, kWidth, kHeight, one.original->bytes)->data, one.encoded.data)
        << "valid after the camera was closed";
  }
  held.erase(held.begin() + 1, held.end());
  LibcameraSource again(kVimc, vimc_spec(PixelFormat::bgr8));
  EXPECT_TRUE(frame_of(again)) << "a frame of the previous opening is still held";
}

TEST_F(Vimc, ItsProcessIsKilled) {
  auto within = back_within();
  test::Leaks leaks;
  pid_t process = 0;
  auto source = std::make_unique<LiveSource>(
      "fish-eye",
      [&process] {
        auto camera = std::make_unique<LibcameraSource>(kVimc, vimc_spec(PixelFormat::bgr8));
        process = camera->process();
        return camera;
      },
      LivePatience{2s, 50ms});
  ASSERT_TRUE(frame_of(*source));
  Clock::duration longest{};
  for (int cycle = 0; cycle < test::cycles(2); ++cycle) {
    kill(process, SIGKILL);
    const Clock::time_point begin = Clock::now();
    while (source->fault().empty() && Clock::now() - begin < 5s) {
      source->next(5ms);
    }
    EXPECT_EQ(source->fault().find("fish-eye: "), 0u);
    while (source->next(0ms)) {
    }
    ASSERT_TRUE(frame_of(*source));
    longest = std::max(longest, Clock::now() - begin);
    leaks.end_of_cycle();
  }
  std::printf("back within %.2f s\n", 1e-9 * static_cast<double>(longest.count()));
  leaks.expect_none();
  source.reset();
  if (longest >= within) {  // the machine may have become slower: measure again
    within = std::max(within, back_within());
  }
  EXPECT_LT(longest, within);
}

TEST_F(Vimc, ReplaysByteForByte) {
  std::ofstream(folder_ / "session.toml")
      << "format = 1\n[color]\nsource = \"libcamera:" << kVimc << "\"\npixel_format = \"bgr8\"\nwidth = " << kWidth
      << "\nheight = " << kHeight << "\nfx = 300\nfy = 300\ncx = 288\ncy = 240\nexposure = 2\n[tag]\nid = 1\n"
      << "size_m = 0.1\n";
  test::expect_identical_replay(folder_, 6);
}

constexpr const char* kUsb = test::UsbPlug::kName;

struct UsbCamera : test::UsbPlug {
  UsbCamera() : UsbPlug([] { return listed(kUsb).has_value(); }) {}
};

TEST(LibcameraUsb, DeliversJpegsAtTheExposureThatWasSet) {
  const UsbCamera camera;
  for (const double exposure_us : {10'000.0, 30'000.0, 5'000.0}) {
    LibcameraSource source(kUsb, usb_spec(exposure_us));
    const auto picture = frame_of(source, 6);
    ASSERT_TRUE(picture && picture->original);
    EXPECT_EQ(picture->original->format, PixelFormat::mjpeg);
    EXPECT_NEAR(picture->encoded.at(20, 60, 0), 50.0 * exposure_us / 10'000.0, 5.0) << exposure_us;
    EXPECT_EQ(picture->exposure, 2.0) << "this camera does not report its exposure";
  }
  EXPECT_NE(error(kUsb, usb_spec(600'000)).find("exposure_us: found 600000.000000, allowed: 100"), std::string::npos);
}

TEST(LibcameraUsb, ACameraWithAnotherSerialNumberIsRefused) {
  const UsbCamera camera;
  StreamSpec spec = usb_spec(10'000);
  spec.serial = "0123";
  EXPECT_EQ(LibcameraSource(kUsb, spec).serial(), "0123");
  spec.serial = "0124";
  EXPECT_NE(error(kUsb, spec).find("found the camera with the serial number \"0123\", allowed: \"0124\""),
            std::string::npos)
      << error(kUsb, spec);
}

TEST(LibcameraUsb, IsListedAsTheSameHardwareAsItsV4l2Camera) {
  const UsbCamera camera;
  std::vector<std::string> said;
  for (const CameraListing& one : list_cameras()) {
    if (one.name.rfind(kUsb, 0) == 0) {
      said.push_back(one.source.substr(0, one.source.find(':')));
      ASSERT_EQ(one.same_hardware.size(), 1u) << one.source;
      said.push_back(one.same_hardware[0].substr(0, one.same_hardware[0].find(':')));
    }
  }
  EXPECT_EQ(said, (std::vector<std::string>{"v4l2", "libcamera", "libcamera", "v4l2"}));
}

TEST(LibcameraUsb, ATornFrameIsLostAndTheNextIsComplete) {
  const UsbCamera camera;
  LibcameraSource source(kUsb, usb_spec(10'000));
  ASSERT_TRUE(frame_of(source, 4));
  camera.signal(SIGUSR1);
  bool torn = false;
  for (int i = 0; i < 40 && !torn; ++i) {
    const auto item = source.next(3000ms);
    ASSERT_TRUE(item);
    torn = std::holds_alternative<LostFrame>(*item);
  }
  EXPECT_TRUE(torn);
  const auto next = frame_of(source);
  ASSERT_TRUE(next);
  EXPECT_NEAR(next->encoded.at(20, test::UsbPlug::kHeight - 5, 0), 50.0, 5.0) << "complete to its last rows";
}

TEST(LibcameraUsb, FrozenWithoutAnError) {
  const UsbCamera camera;
  auto within = back_within();
  auto source = std::make_unique<LiveSource>("fish-eye",
                                             [] { return std::make_unique<LibcameraSource>(kUsb, usb_spec(10'000)); });
  ASSERT_TRUE(frame_of(*source));
  camera.signal(SIGUSR2);
  const Clock::time_point begin = Clock::now();
  while (source->fault().empty() && Clock::now() - begin < 10s) {
    source->next(20ms);
  }
  EXPECT_EQ(source->fault(), "fish-eye: the camera delivers no frames, it is opened again");
  while (source->next(0ms)) {
  }
  camera.signal(SIGUSR2);
  const Clock::time_point back = Clock::now();
  ASSERT_TRUE(frame_of(*source));
  const Clock::duration took = Clock::now() - back;
  std::printf("back within %.2f s\n", 1e-9 * static_cast<double>(took.count()));
  source.reset();
  if (took >= within) {  // the machine may have become slower: measure again
    within = std::max(within, back_within());
  }
  EXPECT_LT(took, within);
}

TEST(LibcameraUsb, UnpluggedAndReplugged) {
  std::unique_ptr<test::UsbPlug> camera = std::make_unique<UsbCamera>();
  LiveSource source("fish-eye", [] { return std::make_unique<LibcameraSource>(kUsb, usb_spec(10'000)); });
  test::expect_back_again(
      source, 2, "fish-eye: libcamera:Test Camera: found no such camera, or another program has it",
      [&] { camera.reset(); }, [&] { camera = std::make_unique<test::UsbPlug>(); }, back_within);
}

}  // namespace
}  // namespace lumigraft::capture
