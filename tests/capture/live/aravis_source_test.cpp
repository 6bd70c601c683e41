// Tests with the real Aravis library and its fake GigE Vision camera on a loopback address, in a process of its own.
#include <arv.h>
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <optional>

#include "capture/error.h"
#include "capture/live/aravis/source.h"
#include "capture/live/camera_list.h"
#include "tests/capture/live/gige_camera.h"

namespace lumigraft::capture {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;
// Small, so that a frame fits into the kernel's socket buffer while the machine is busy.
constexpr int kWidth = 160;
constexpr int kHeight = 120;

using CameraProcess = test::GigeCamera;
constexpr const char* kName = test::GigeCamera::kName;

StreamSpec spec_of(PixelFormat format) {
  StreamSpec spec{.stream = Stream::fisheye, .width = kWidth, .height = kHeight, .exposure = 2.5};
  spec.settings.pixel_format = format;
  return spec;
}

std::string error(const std::string& name, const StreamSpec& spec) {
  try {
    AravisSource source(name, spec);
  } catch (const InputError& e) {
    EXPECT_EQ(std::string(e.what()).find('\n'), std::string::npos) << e.what();
    return e.what();
  }
  return "no error";
}

TEST(Aravis, DeliversEveryFormatInOrder) {
  const CameraProcess camera;
  ASSERT_TRUE(camera.running());
  for (const PixelFormat format : {PixelFormat::grey8, PixelFormat::grey16, PixelFormat::rgb8, PixelFormat::bayer_rggb8,
                                   PixelFormat::bayer_gbrg8}) {
    AravisSource source(kName, spec_of(format));
    std::optional<Stamp> last;
    int complete = 0;
    // A busy machine may lose packets on its loopback; frames that arrive must be correct and in order.
    for (int i = 0; complete < 5 && i < 30; ++i) {
      const auto item = source.next(3000ms);
      ASSERT_TRUE(item) << name_of(format);
      const auto* picture = std::get_if<Frame>(&*item);
      if (picture == nullptr) {
        continue;
      }
      ++complete;
      EXPECT_EQ(picture->stream, Stream::fisheye);
      EXPECT_EQ(picture->exposure, 2.5);
      EXPECT_EQ(picture->encoded.width, kWidth);
      EXPECT_EQ(picture->original == nullptr, format == PixelFormat::rgb8);
      EXPECT_TRUE(!last || picture->stamp.time_ns > last->time_ns);
      EXPECT_TRUE(!last || picture->stamp.sequence > last->sequence);
      if (format == PixelFormat::grey8) {
        EXPECT_TRUE(test::is_ramp(picture->encoded));
      }
      last = picture->stamp;
    }
    EXPECT_EQ(complete, 5) << name_of(format);
    EXPECT_FALSE(source.finished());
    EXPECT_EQ(source.take_warning(), "") << "a camera without chunks gives no warning";
  }
}

TEST(Aravis, SettingsAreApplied) {
  const CameraProcess camera;
  ASSERT_TRUE(camera.running());
  StreamSpec spec = spec_of(PixelFormat::grey8);
  spec.settings.exposure_us = 4321.0;
  spec.settings.gain = 3.0;
  spec.settings.controls = {{"TestRegister", 77}};
  {
    AravisSource source(kName, spec);
    EXPECT_TRUE(source.next(3000ms));
  }
  const std::vector<CameraListing> all = list_aravis_cameras();
  const auto listed =
      std::find_if(all.begin(), all.end(), [](const auto& c) { return c.source == "aravis:Aravis-Fake-GV77"; });
  ASSERT_NE(listed, all.end());
  EXPECT_EQ(listed->rejection_reason, "");
  EXPECT_TRUE(std::any_of(listed->formats.begin(), listed->formats.end(),
                          [](const auto& f) { return f.pixels == "bayer-rggb8" && f.width == 2048; }));
  const auto control = [&](const std::string& name) {
    const auto found =
        std::find_if(listed->controls.begin(), listed->controls.end(), [&](const auto& c) { return c.name == name; });
    return found == listed->controls.end() ? -1.0 : found->value;
  };
  EXPECT_NEAR(control("exposure_us"), 4321.0, 1.0);
  EXPECT_NEAR(control("gain"), 3.0, 0.5);
}

TEST(Aravis, WhiteBalanceHasASelector) {
  const CameraProcess camera("0", "chunks");
  ASSERT_TRUE(camera.running());
  StreamSpec spec = spec_of(PixelFormat::bayer_rggb8);
  spec.settings.controls = {{"BalanceRatio[Blue]", 1.25}, {"BalanceRatio[Red]", 1.75}};
  {
    AravisSource source(kName, spec);
    EXPECT_TRUE(source.next(3000ms));
  }
  ArvCamera* after = arv_camera_new(kName, nullptr);
  ASSERT_NE(after, nullptr);
  for (const auto& [entry, ratio] : {std::pair("Red", 1.75), std::pair("Blue", 1.25)}) {
    arv_camera_set_string(after, "BalanceRatioSelector", entry, nullptr);
    EXPECT_EQ(arv_camera_get_float(after, "BalanceRatio", nullptr), ratio) << entry;
  }
  g_object_unref(after);
  spec.settings.controls = {{"BalanceRatio[Green]", 1.0}};
  EXPECT_NE(error(kName, spec).find("controls.BalanceRatio[Green]: found \"Green\", allowed: Red, Blue"),
            std::string::npos)
      << error(kName, spec);
  spec.settings.controls = {{"TestRegister[Red]", 1.0}};
  EXPECT_NE(error(kName, spec).find("controls.TestRegister[Red]: found no TestRegisterSelector"), std::string::npos);
}

TEST(Aravis, WhatItDoesNotOfferIsRefusedAndSaid) {
  CameraProcess::take_loopback();
  EXPECT_NE(
      error("Aravis-Fake-GV99", spec_of(PixelFormat::grey8)).find("aravis:Aravis-Fake-GV99: found no such camera"),
      std::string::npos);
  const CameraProcess camera;
  ASSERT_TRUE(camera.running());
  EXPECT_NE(error(kName, spec_of(PixelFormat::nv12)).find("found no pixel format nv12, offered: "), std::string::npos);
  StreamSpec spec = spec_of(PixelFormat::grey8);
  spec.width = 5000;
  EXPECT_NE(error(kName, spec).find("found a sensor of 2048x2048 pixels"), std::string::npos);
  spec = spec_of(PixelFormat::bayer_rggb8);
  spec.width = 161;
  EXPECT_NE(error(kName, spec).find("even numbers"), std::string::npos);
  spec = spec_of(PixelFormat::grey8);
  spec.settings.controls = {{"NoSuchThing", 1}};
  EXPECT_NE(error(kName, spec).find("controls.NoSuchThing"), std::string::npos);
}

TEST(Aravis, LostPacketsLoseFramesAndTearNone) {
  const CameraProcess camera("0.02");
  ASSERT_TRUE(camera.running());
  AravisSource source(kName, spec_of(PixelFormat::grey8));
  std::uint64_t complete = 0, lost = 0, next = 0;
  Image<std::uint8_t> before;
  const Clock::time_point deadline = Clock::now() + 6s;
  while (complete + lost < 60 && Clock::now() < deadline) {
    const auto item = source.next(500ms);
    if (!item) {
      continue;
    }
    const auto* picture = std::get_if<Frame>(&*item);
    const Stamp& stamp = picture != nullptr ? picture->stamp : std::get<LostFrame>(*item).stamp;
    lost += stamp.sequence - next + (picture == nullptr ? 1 : 0);
    next = stamp.sequence + 1;
    if (picture != nullptr) {
      EXPECT_TRUE(test::is_ramp(picture->encoded));
      if (complete > 0) {
        // A damaged frame would contain rows of the previous one.
        const auto middle = static_cast<std::ptrdiff_t>(before.data.size() / 2);
        std::copy(picture->encoded.data.begin(), picture->encoded.data.begin() + middle, before.data.begin());
        EXPECT_FALSE(test::is_ramp(before));
      }
      before = picture->encoded;
      ++complete;
    }
  }
  EXPECT_GT(complete, 5u);
  EXPECT_GT(lost, 0u) << "no packets were lost: nothing was tested";
}

TEST(Aravis, LostPacketsAreAskedForAgain) {
  for (const std::string network : {"forgetting", "resending"}) {
    const CameraProcess camera("0", network);
    ASSERT_TRUE(camera.running());
    AravisSource source(kName, spec_of(PixelFormat::grey8));
    const std::uint64_t enough = network == "resending" ? 20 : 5;
    std::uint64_t complete = 0;
    const Clock::time_point deadline = Clock::now() + 6s;
    std::optional<Stamp> first, last;
    while (complete < enough && Clock::now() < deadline) {
      const auto item = source.next(500ms);
      const auto* picture = item ? std::get_if<Frame>(&*item) : nullptr;
      if (picture == nullptr) {
        continue;
      }
      EXPECT_TRUE(test::is_ramp(picture->encoded));
      ++complete;
      last = picture->stamp;
      first = first.value_or(*last);
    }
    ASSERT_GT(complete, 1u) << network;
    const auto missing = last->sequence - first->sequence + 1 - complete;
    std::printf("%s: %d of %d pictures missing\n", network.c_str(), static_cast<int>(missing),
                static_cast<int>(missing + complete));
    if (network == "resending") {
      EXPECT_LT(missing, 4u) << "a busy machine may lose a few";
    } else {
      EXPECT_GT(missing, 8u) << "most of them";
    }
  }
}

StreamSpec spec_with_exposure() {
  StreamSpec spec = spec_of(PixelFormat::grey8);
  spec.settings.exposure_us = 10000.0;
  spec.settings.gain = 0.0;  // in decibels
  return spec;
}

/// Exposure from the chunks of odd and even frames (gige_chunks.h); the session's is 2.5.
double reported_exposure(bool odd) { return 2.5 * (odd ? 3.0 : 2.0) * std::pow(10.0, 6.0 / 20.0); }

TEST(Aravis, ChunksGiveTimeExposureAndGainOfEachFrame) {
  for (const std::string kind : {"chunks", "chunks-appended", "chunks-alone", "chunks-ticks"}) {
    const CameraProcess camera("0", kind);
    ASSERT_TRUE(camera.running());
    AravisSource source(kName, spec_with_exposure());
    int complete = 0, odd_ones = 0;
    for (int i = 0; complete < 8 && i < 30; ++i) {
      const auto item = source.next(3000ms);
      ASSERT_TRUE(item) << kind;
      const auto* picture = std::get_if<Frame>(&*item);
      if (picture == nullptr) {
        continue;  // a busy machine may lose packets
      }
      ++complete;
      EXPECT_TRUE(test::is_ramp(picture->encoded)) << kind;
      const std::int64_t digits = picture->stamp.time_ns % 1000;
      const bool odd = kind == "chunks-ticks" ? picture->exposure > 12.0 : digits == 501;
      EXPECT_TRUE(digits == (kind == "chunks-ticks" ? 500 / 8 * 8 : odd ? 501 : 500)) << kind << ' ' << digits;
      EXPECT_NEAR(picture->exposure, reported_exposure(odd), 1e-6) << kind;
      odd_ones += odd ? 1 : 0;
    }
    EXPECT_EQ(complete, 8) << kind;
    EXPECT_TRUE(odd_ones > 0 && odd_ones < complete) << kind << ": nothing was tested";
    EXPECT_EQ(source.take_warning(), "") << kind;
  }
}

TEST(Aravis, FramesSayHowFastRowsAreRead) {
  for (const auto& [kind, readout_s] :
       {std::pair("chunks", std::optional<double>()), std::pair("chunks-global", std::optional(0.0)),
        std::pair("chunks-rolling", std::optional(0.0185))}) {
    const CameraProcess camera("0", kind);
    ASSERT_TRUE(camera.running());
    AravisSource source(kName, spec_of(PixelFormat::grey8));
    std::optional<SourceItem> item;
    for (int i = 0; i < 30 && !(item && std::holds_alternative<Frame>(*item)); ++i) item = source.next(3000ms);
    ASSERT_TRUE(item && std::holds_alternative<Frame>(*item)) << kind;
    EXPECT_EQ(std::get<Frame>(*item).readout_s, readout_s) << kind;
  }
}

TEST(Aravis, AGainWithoutAUnitIsAFactor) {
  const CameraProcess camera("0", "chunks-factor");
  ASSERT_TRUE(camera.running());
  StreamSpec spec = spec_with_exposure();
  spec.settings.gain = 2.0;
  AravisSource source(kName, spec);
  const auto item = source.next(3000ms);
  ASSERT_TRUE(item && std::holds_alternative<Frame>(*item));
  const auto& picture = std::get<Frame>(*item);
  const double exposure_ratio = picture.stamp.time_ns % 1000 == 501 ? 3.0 : 2.0;
  EXPECT_NEAR(picture.exposure, 2.5 * exposure_ratio * 8.0 / 2.0, 1e-6);
}

TEST(Aravis, ADamagedChunkLosesNoFrameAndIsReportedOnce) {
  const std::pair<std::string, std::string> kinds[] = {{"chunks-torn", "their lengths are wrong"},
                                                       {"chunks-short", "ChunkTimestamp has 4 bytes, not 8"},
                                                       {"chunks-missing", "ChunkTimestamp is missing"},
                                                       {"chunks-impossible", "exposure time (us) nan"}};
  for (const auto& [kind, says] : kinds) {
    const CameraProcess camera("0", kind);
    ASSERT_TRUE(camera.running());
    AravisSource source(kName, spec_with_exposure());
    int complete = 0, kept = 0, warnings = 0;
    std::optional<Stamp> last;
    double last_exposure = 0;
    for (int i = 0; complete < 24 && i < 60; ++i) {
      const auto item = source.next(3000ms);
      ASSERT_TRUE(item) << kind;
      const std::string warning = source.take_warning();
      warnings += warning.empty() ? 0 : 1;
      EXPECT_TRUE(warning.empty() || warning.find(says) != std::string::npos) << warning;
      const auto* picture = std::get_if<Frame>(&*item);
      if (picture == nullptr) {
        EXPECT_EQ(std::get<LostFrame>(*item).reason, "packets are missing") << "a busy machine may lose packets";
        continue;
      }
      ++complete;
      EXPECT_TRUE(test::is_ramp(picture->encoded)) << kind;
      const bool odd = picture->exposure > reported_exposure(false) + 1e-6;
      EXPECT_NEAR(picture->exposure, reported_exposure(odd), 1e-6) << kind;
      kept += picture->exposure == last_exposure ? 1 : 0;
      last_exposure = picture->exposure;
      const std::int64_t digits = picture->stamp.time_ns % 1000;
      EXPECT_TRUE(digits == 500 || digits == 501)
          << kind << ": a leader's time ends in 000 and is shifted by the last chunk's difference";
      EXPECT_TRUE(!last || picture->stamp.time_ns > last->time_ns) << kind;
      last = picture->stamp;
    }
    EXPECT_EQ(complete, 24) << kind;
    EXPECT_EQ(warnings, 1) << kind;
    if (kind == "chunks-torn" || kind == "chunks-impossible") {
      EXPECT_TRUE(kept >= 4 && kept <= 8) << kept << ": in one frame of eight that of the even frames before and after";
    } else {
      EXPECT_LE(kept, 1) << kind << ": only the time is missing; a busy machine may lose a frame";
    }
  }
}

TEST(Aravis, AnAutomaticExposureThatIsReportedIsFollowed) {
  const CameraProcess camera("0", "chunks-automatic");
  ASSERT_TRUE(camera.running());
  for (const Stream stream : {Stream::color, Stream::fisheye}) {
    StreamSpec spec = spec_of(PixelFormat::grey8);
    spec.stream = stream;
    AravisSource source(kName, spec);
    std::map<bool, double> exposure;  // of odd and even frames
    for (int i = 0; exposure.size() < 2 && i < 30; ++i) {
      const auto item = source.next(3000ms);
      ASSERT_TRUE(item);
      if (const auto* picture = std::get_if<Frame>(&*item)) {
        EXPECT_TRUE(!exposure.empty() || picture->exposure == 2.5) << "the session's holds for the first frame";
        exposure[picture->stamp.time_ns % 1000 == 501] = picture->exposure;
      }
    }
    ASSERT_EQ(exposure.size(), 2u);
    EXPECT_NEAR(exposure[true] / exposure[false], 3.0 / 2.0, 1e-6);
  }
  StreamSpec spec = spec_of(PixelFormat::grey8);
  spec.settings.controls = {{"ChunkModeActive", 0}};
  EXPECT_EQ(error(kName, spec).find("aravis:" + std::string(kName) + ": auto-exposure: "), 0u) << error(kName, spec);
}

TEST(Aravis, ChunksCanBeDisabled) {
  const CameraProcess camera("0", "chunks");
  ASSERT_TRUE(camera.running());
  StreamSpec spec = spec_with_exposure();
  spec.settings.controls = {{"ChunkModeActive", 0}};
  AravisSource source(kName, spec);
  const auto item = source.next(3000ms);
  ASSERT_TRUE(item && std::holds_alternative<Frame>(*item));
  EXPECT_EQ(std::get<Frame>(*item).exposure, 2.5);
  EXPECT_EQ(std::get<Frame>(*item).stamp.time_ns % 1000, 0) << "the leader's time";
  EXPECT_EQ(source.take_warning(), "");
}

}  // namespace
}  // namespace lumigraft::capture
