// A USB webcam: the kernel's uvcvideo driver with the camera of usb_camera.cpp on an emulated port.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <fstream>
#include <map>

#include "capture/error.h"
#include "capture/live/camera_list.h"
#include "capture/live/live_source.h"
#include "capture/live/v4l2/source.h"
#include "capture/sync/pairing_reader.h"
#include "tests/capture/live/small_camera.h"
#include "tests/capture/recorded_frames.h"
#include "tests/capture/scratch_folder.h"
#include "tests/integration/camera_vm/back_again.h"
#include "tests/integration/camera_vm/usb_plug.h"
#include "tests/integration/camera_vm/vivid_camera.h"

namespace lumigraft::capture {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;
using test::frame_of;
using test::usb_spec;
using test::UsbPlug;
constexpr const char* kName = UsbPlug::kName;
constexpr double kLevelAt10ms = 50.0;

std::optional<CameraListing> listed_by_name() {
  for (const CameraListing& one : list_v4l2_cameras()) {
    if (one.name.rfind(kName, 0) == 0 && one.rejection_reason.empty()) {
      return one;
    }
  }
  return std::nullopt;
}

void expect_bars(const Frame& picture, double exposure_us) {
  ASSERT_EQ(picture.encoded.width, UsbPlug::kWidth);
  ASSERT_EQ(picture.encoded.height, UsbPlug::kHeight);
  const double level = std::min(255.0, kLevelAt10ms * exposure_us / 10'000.0);
  for (int bar = 0; bar < 4; ++bar) {
    for (int c = 0; c < 3; ++c) {
      EXPECT_NEAR(picture.encoded.at((2 * bar + 1) * UsbPlug::kWidth / 8, UsbPlug::kHeight / 2, c),
                  bar == c || bar == 3 ? level : 0.0, 5.0)
          << "bar " << bar << ", channel " << c << " at " << exposure_us << " us";
    }
  }
}

TEST(UsbCamera, DeliversJpegsAtTheExposureThatWasSet) {
  const UsbPlug camera;
  for (const double wanted_us : {10'000.0, 30'000.0, 5'000.0, 10'040.0}) {
    const double exposure_us = 100 * std::round(wanted_us / 100);  // the driver's unit
    StreamSpec spec = usb_spec(wanted_us);
    spec.settings.gain = 99;
    spec.settings.controls = {{"white_balance_temperature", 3500}};
    V4l2Source source(kName, spec);
    const auto picture = frame_of(source, 4);
    ASSERT_TRUE(picture && picture->original);
    expect_bars(*picture, exposure_us);
    EXPECT_EQ(picture->original->format, PixelFormat::mjpeg);
    EXPECT_DOUBLE_EQ(picture->exposure, 2.0 * exposure_us / wanted_us);
    EXPECT_TRUE(source.on_host_clock());
    const auto listing = listed_by_name();
    ASSERT_TRUE(listing);
    const auto value = [&](const std::string& name) {
      const auto found = std::find_if(listing->controls.begin(), listing->controls.end(),
                                      [&](const OfferedControl& c) { return c.name == name; });
      return found != listing->controls.end() ? found->value : -1.0;
    };
    EXPECT_EQ(value("exposure_us"), exposure_us);
    EXPECT_EQ(value("auto_exposure"), 1.0) << "manual exposure";
    EXPECT_EQ(value("gain"), 99.0);
    EXPECT_EQ(value("white_balance_automatic"), 0.0);
    EXPECT_EQ(value("power_line_frequency"), 1.0) << "50 Hz: the camera cannot detect it";
    EXPECT_EQ(value("white_balance_temperature"), 3500.0);
    ASSERT_EQ(listing->formats.size(), 1u);
    EXPECT_EQ(listing->formats[0].pixels, "mjpeg");
    EXPECT_NEAR(listing->formats[0].rate_hz, 20.0, 0.01);
  }
}

TEST(UsbCamera, AutomaticExposureSettlesAndIsHeld) {
  const UsbPlug camera(UsbPlug::known_to_the_kernel, {"adapting"});
  constexpr double kAdapted_us = 24'000;
  StreamSpec spec = usb_spec(10'000);
  spec.stream = Stream::color;
  {
    V4l2Source stated(kName, spec);
    const auto picture = frame_of(stated, 4);
    ASSERT_TRUE(picture);
    expect_bars(*picture, 10'000);
    EXPECT_EQ(stated.take_warning(), "") << "a stated exposure is not changed";
  }
  spec.settings.exposure_us.reset();
  V4l2Source source(kName, spec);
  EXPECT_EQ(source.take_warning().find("colour: automatic exposure is held: exposure_us = 2"), 0u);
  for (int i = 0; i < 12; ++i) {
    const auto picture = frame_of(source);
    ASSERT_TRUE(picture);
    EXPECT_EQ(picture->stamp.sequence, static_cast<std::uint64_t>(i)) << "frames before are not counted as lost";
    expect_bars(*picture, kAdapted_us);
  }
  const auto listing = listed_by_name();
  ASSERT_TRUE(listing);
  std::map<std::string, double> value;
  for (const OfferedControl& control : listing->controls) value[control.name] = control.value;
  EXPECT_EQ(value["auto_exposure"], 1.0) << "manual";
  EXPECT_NEAR(value["exposure_us"], kAdapted_us, 500.0);
  EXPECT_EQ(value["white_balance_automatic"], 0.0);
}

TEST(UsbCamera, AControlDisabledByAnotherIsRefused) {
  const UsbPlug camera;
  StreamSpec spec = usb_spec(10'000);
  spec.settings.controls = {{"white_balance_automatic", 1}, {"white_balance_temperature", 3500}};
  try {
    const V4l2Source source(kName, spec);
    FAIL() << "no error";
  } catch (const InputError& e) {
    EXPECT_STREQ(
        e.what(),
        "v4l2:Test Camera: controls.white_balance_temperature: found 3500, which the camera does not take now");
  }
}

TEST(UsbCamera, EachFrameOfABracketHasItsOwnExposure) {
  const UsbPlug camera;
  StreamSpec spec = usb_spec(10'000);
  spec.settings.bracket_us = {5'000, 10'000, 40'000};
  V4l2Source source(kName, spec);
  std::uint64_t sequence = 0;
  std::int64_t before_ns = 0;
  for (int bracket = 0; bracket < 4; ++bracket) {
    std::int64_t time_ns = 0;
    std::this_thread::sleep_for(bracket * 200ms);  // frames queue up while nothing reads them
    for (const double exposure_us : spec.settings.bracket_us) {
      const auto picture = frame_of(source);
      ASSERT_TRUE(picture);
      EXPECT_DOUBLE_EQ(picture->exposure, 2.0 * exposure_us / 10'000);
      expect_bars(*picture, exposure_us);
      EXPECT_EQ(picture->stamp.sequence, sequence++) << "no frame is missing";
      EXPECT_TRUE(time_ns == 0 || picture->stamp.time_ns == time_ns) << "all frames of a bracket have one time";
      EXPECT_GT(picture->stamp.time_ns, before_ns);
      time_ns = picture->stamp.time_ns;
    }
    before_ns = time_ns;
  }
}

TEST(UsbCamera, EveryBracketReachesAFrameOfALiveColourCamera) {
  const UsbPlug camera;
  StreamSpec bracketed = usb_spec(10'000);
  bracketed.settings.bracket_us = {5'000, 10'000};
  PairedSources sources;
  StreamSpec color = test::vivid_spec(PixelFormat::rgb8);
  color.stream = Stream::color;
  sources.color =
      std::make_shared<LiveSource>("colour", [&] { return std::make_unique<V4l2Source>(test::kSinglePlanar, color); });
  sources.fisheye = std::make_shared<LiveSource>(
      "fish-eye", [&] { return std::make_unique<V4l2Source>(kName, bracketed); }, LivePatience{6s, 500ms});
  sources.live = true;
  PairingReader reader(sources);
  std::optional<std::uint64_t> next;
  const Clock::time_point begin = Clock::now();
  while (next.value_or(0) < 14 && Clock::now() - begin < 30s) {
    const auto frame = reader.next(1s);
    if (!frame || frame->fisheye.empty()) {
      continue;
    }
    ASSERT_EQ(frame->fisheye.size(), 2u);
    if (next) {
      EXPECT_EQ(frame->fisheye[0]->stamp.sequence, *next);
    } else {
      EXPECT_LE(frame->fisheye[0]->stamp.sequence, 2u) << "the first bracket may come before the first colour frame";
    }
    EXPECT_EQ(frame->fisheye[1]->stamp.sequence, frame->fisheye[0]->stamp.sequence + 1);
    EXPECT_NEAR(1e-9 * static_cast<double>(frame->time_ns - frame->fisheye[0]->stamp.time_ns), 0.0, 0.25);
    next = frame->fisheye[1]->stamp.sequence + 1;
  }
  EXPECT_GE(next.value_or(0), 14u);
}

TEST(UsbCamera, ATornFrameIsLostAndTheNextIsComplete) {
  const UsbPlug camera;
  V4l2Source source(kName, usb_spec(10'000));
  ASSERT_TRUE(frame_of(source, 4));
  camera.signal(SIGUSR1);
  std::optional<Stamp> torn;
  for (int i = 0; i < 40 && !torn; ++i) {
    const auto item = source.next(3000ms);
    ASSERT_TRUE(item);
    if (const auto* lost = std::get_if<LostFrame>(&*item)) {
      EXPECT_EQ(lost->reason, "the picture is damaged");
      torn = lost->stamp;
    }
  }
  ASSERT_TRUE(torn);
  const auto next = frame_of(source);
  ASSERT_TRUE(next);
  EXPECT_GT(next->stamp.sequence, torn->sequence);
  expect_bars(*next, 10'000);
}

TEST(UsbCamera, UnpluggedAndReplugged) {
  auto camera = std::make_unique<UsbPlug>();
  LiveSource source("fish-eye", [] { return std::make_unique<V4l2Source>(kName, usb_spec(10'000)); });
  test::expect_back_again(
      source, 3, "fish-eye: v4l2:Test Camera: found no such camera", [&] { camera.reset(); },
      [&] { camera = std::make_unique<UsbPlug>(); });
}

class RecordedUsbCamera : public test::ScratchFolder {};

TEST_F(RecordedUsbCamera, ReplaysByteForByte) {
  const UsbPlug camera;
  std::ofstream(folder_ / "session.toml") << "format = 1\n[color]\nsource = \"v4l2:Test Camera\"\n"
                                          << test::kSmallCamera << "exposure_us = 10000\n[tag]\nid = 1\nsize_m = 0.1\n";
  test::expect_identical_replay(folder_, 6);
}

}  // namespace
}  // namespace lumigraft::capture
