// Frames of a V4L2 camera: the kernel's virtual camera vivid shows eight bars of 75 % (ITU-R BT.471), white to black.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>

#include "capture/error.h"
#include "capture/live/camera_list.h"
#include "capture/live/v4l2/source.h"
#include "tests/capture/recorded_frames.h"
#include "tests/capture/scratch_folder.h"
#include "tests/integration/camera_vm/back_again.h"
#include "tests/integration/camera_vm/driver_memory.h"
#include "tests/integration/camera_vm/vivid_camera.h"

namespace lumigraft::capture {
namespace {

using test::frame_of;
using test::k75;
using test::kBars;
using test::kMultiPlanar;
using test::kSinglePlanar;
using test::kVividHeight;
using test::kVividWidth;
using test::vivid_spec;

void expect_vivid_bars(const Frame& picture, PixelFormat format) {
  ASSERT_EQ(picture.encoded.width, kVividWidth);
  ASSERT_EQ(picture.encoded.height, kVividHeight);
  const bool grey = grey_bits(format) != 0;
  for (int bar = 0; bar < 8; ++bar) {
    const auto& [r, g, b] = kBars[static_cast<std::size_t>(bar)];
    const double luma = 0.2126 * r + 0.7152 * g + 0.0722 * b;  // vivid's grey is BT.709 luma, 0 to 255
    for (const int y : {4, kVividHeight / 2, kVividHeight - 5}) {
      for (int c = 0; c < 3; ++c) {
        const double wanted = grey ? luma : kBars[static_cast<std::size_t>(bar)][static_cast<std::size_t>(c)];
        EXPECT_NEAR(picture.encoded.at(bar * kVividWidth / 8 + kVividWidth / 16, y, c), wanted, 3.0)
            << name_of(format) << ", bar " << bar << ", row " << y << ", channel " << c;
      }
    }
  }
}

TEST(Vivid, EveryFormatShowsTheColourBars) {
  for (const PixelFormat format :
       {PixelFormat::yuyv, PixelFormat::nv12, PixelFormat::rgb8, PixelFormat::bgr8, PixelFormat::uyvy,
        PixelFormat::grey8, PixelFormat::grey10, PixelFormat::grey12, PixelFormat::grey16, PixelFormat::bayer_rggb8,
        PixelFormat::bayer_bggr8, PixelFormat::bayer_gbrg8, PixelFormat::bayer_grbg8}) {
    for (const char* camera : {kSinglePlanar, kMultiPlanar}) {
      V4l2Source source(camera, vivid_spec(format));
      const auto picture = frame_of(source);
      ASSERT_TRUE(picture);
      EXPECT_EQ(picture->stream, Stream::fisheye);
      EXPECT_EQ(picture->exposure, 2.5);
      expect_vivid_bars(*picture, format);
      ASSERT_EQ(picture->original == nullptr, format == PixelFormat::rgb8);
      if (picture->original) {
        EXPECT_EQ(picture->original->format, format);
        EXPECT_EQ(picture->original->bytes.size(), *bytes_of(format, kVividWidth, kVividHeight));
      }
    }
  }
}

TEST(Vivid, ChoosesUncompressedColour) {
  StreamSpec spec = vivid_spec(PixelFormat::yuyv);
  spec.settings.pixel_format.reset();
  V4l2Source source("", spec);
  const auto picture = frame_of(source);
  ASSERT_TRUE(picture && picture->original);
  EXPECT_EQ(picture->original->format, PixelFormat::yuyv);
}

TEST(Vivid, IsFoundByEveryName) {
  for (const char* name : {"/dev/video0", "usb-Maker_Camera_0123-video-index0",
                           "/dev/v4l/by-id/usb-Maker_Camera_0123-video-index0", "vivid", "platform:vivid-000"}) {
    V4l2Source source(name, vivid_spec(PixelFormat::grey8));
    EXPECT_TRUE(frame_of(source)) << name;
  }
}

TEST(Vivid, SequenceAndTimesIncrease) {
  StreamSpec spec = vivid_spec(PixelFormat::grey8);
  spec.settings.rate_hz = 25.0;
  V4l2Source source(kSinglePlanar, spec);
  Stamp last;
  std::vector<std::int64_t> periods_ns;
  for (int i = 0; i < 40; ++i) {
    const auto picture = frame_of(source);
    ASSERT_TRUE(picture);
    EXPECT_TRUE(source.on_host_clock());
    EXPECT_NEAR(1e-9 * static_cast<double>(picture->stamp.time_ns - picture->stamp.host_time_ns), 0.0, 0.5);
    if (i > 0) {
      EXPECT_GT(picture->stamp.time_ns, last.time_ns);
      ASSERT_GT(picture->stamp.sequence, last.sequence);
      periods_ns.push_back((picture->stamp.time_ns - last.time_ns) /
                           static_cast<std::int64_t>(picture->stamp.sequence - last.sequence));
    }
    last = picture->stamp;
  }
  std::nth_element(periods_ns.begin(), periods_ns.begin() + 20, periods_ns.end());
  EXPECT_NEAR(static_cast<double>(periods_ns[20]) * 1e-6, 40.0, 2.0) << "ms per sequence number, lost frames included";
}

/// Whether the bytes lie in the driver's memory.
bool is_of_the_driver(std::span<const std::uint8_t> bytes) { return test::lies_in(bytes, "/dev/video"); }

TEST(Vivid, FramesAreNotCopiedAndStayValid) {
  auto source = std::make_unique<V4l2Source>(kSinglePlanar, vivid_spec(PixelFormat::yuyv));
  std::vector<Frame> held;
  int of_the_driver = 0;
  for (int i = 0; i < 12; ++i) {  // more frames than there are buffers
    auto picture = frame_of(*source);
    ASSERT_TRUE(picture && picture->original);
    of_the_driver += is_of_the_driver(picture->original->bytes) ? 1 : 0;
    held.push_back(std::move(*picture));
  }
  EXPECT_EQ(of_the_driver, 4) << "four buffers stay with the driver, other frames are copied";
  held.clear();
  const auto last = frame_of(*source);
  ASSERT_TRUE(last && is_of_the_driver(last->original->bytes));
  source.reset();
  EXPECT_FALSE(is_of_the_driver(last->original->bytes)) << "a mapping would keep the camera open";
  PixelConverter converter;
  EXPECT_EQ(converter.to_rgb(PixelFormat::yuyv, kVividWidth, kVividHeight, last->original->bytes)->data,
            last->encoded.data)
      << "valid after the camera was closed";
}

std::string v4l2_error(const std::string& camera, const StreamSpec& spec) {
  try {
    const V4l2Source source(camera, spec);
  } catch (const CameraFault& e) {
    return std::string("fault: ") + e.what();
  } catch (const InputError& e) {
    return std::string("error: ") + e.what();
  }
  return "no error";
}

TEST(Vivid, WhatItDoesNotOfferIsRefusedAndSaid) {
  const auto with = [](auto change) {
    StreamSpec spec = vivid_spec(PixelFormat::yuyv);
    change(spec);
    return v4l2_error("/dev/video0", spec);
  };
  EXPECT_EQ(with([](StreamSpec& s) {
              s.settings.pixel_format = PixelFormat::mjpeg;
            }).find("error: v4l2:/dev/video0: found no pixel format mjpeg for 320x180 pixels, offered: "),
            0u);
  EXPECT_EQ(with([](StreamSpec& s) { s.width = 324; }).find("error: v4l2:/dev/video0: found no pictures of 324x180"),
            0u);
  EXPECT_EQ(with([](StreamSpec& s) { s.settings.rate_hz = 777; }).find("error: v4l2:/dev/video0: rate_hz: "), 0u);
  EXPECT_EQ(with([](StreamSpec& s) {
              s.settings.exposure_us = 100;
            }).find("error: v4l2:/dev/video0: exposure_us: found a camera whose exposure is not known"),
            0u);
  EXPECT_EQ(with([](StreamSpec& s) { s.settings.gain = 256; }),
            "error: v4l2:/dev/video0: gain: found 256, allowed: 0 to 255");
  EXPECT_EQ(with([](StreamSpec& s) {
              s.settings.controls = {{"No Such Thing", 1}};
            }).find("error: v4l2:/dev/video0: controls.No Such Thing: found no such number"),
            0u);
  EXPECT_EQ(with([](StreamSpec& s) {
              s.settings.controls = {{"read_only_integer_32_bits", 1}};
            }).find("error: v4l2:/dev/video0: controls.read_only_integer_32_bits: found a control that can only be"),
            0u);
  EXPECT_EQ(v4l2_error("/dev/null", vivid_spec(PixelFormat::yuyv)).find("error: v4l2:/dev/null: found no camera"), 0u);
}

double control(const std::string& camera, const std::string& name) {
  for (const CameraListing& listing : list_v4l2_cameras()) {
    for (const OfferedControl& c : listing.controls) {
      if (listing.name.find(camera) != std::string::npos && c.name == name) {
        return c.value;
      }
    }
  }
  return -1.0;
}

TEST(Vivid, SettingsAreApplied) {
  {
    const test::Vivid camera;
    ASSERT_TRUE(camera.set("Gain, Automatic", 1));
  }
  StreamSpec spec = vivid_spec(PixelFormat::rgb8);
  spec.settings.gain = 77;
  spec.settings.rate_hz = 10.0;
  spec.settings.controls = {{"osd_text_mode", 2}, {"Brightness", 96}};
  V4l2Source source("/dev/video0", spec);
  EXPECT_EQ(control("/dev/video0", "gain"), 77.0);
  EXPECT_EQ(control("/dev/video0", "gain_automatic"), 0.0) << "radiance needs a fixed response";
  EXPECT_EQ(control("/dev/video0", "brightness"), 96.0);
  const auto first = frame_of(source);
  auto last = first;
  for (int i = 0; i < 9; ++i) {
    last = frame_of(source);
  }
  ASSERT_TRUE(first && last);
  EXPECT_NEAR(first->encoded.at(kVividWidth / 16, kVividHeight / 2), k75 - 32, 3) << "brightness";
  EXPECT_NEAR(static_cast<double>(last->stamp.time_ns - first->stamp.time_ns) * 1e-6 /
                  static_cast<double>(last->stamp.sequence - first->stamp.sequence),
              100.0, 5.0)
      << "ms";
  const test::Vivid camera;
  EXPECT_TRUE(camera.set("Brightness", 128));
}

TEST(Vivid, IsListedCompletely) {
  const std::vector<CameraListing> all = list_v4l2_cameras();
  ASSERT_EQ(all.size(), 3u) << "two webcams and the frame grabber";
  EXPECT_EQ(all[0].source, "v4l2:usb-Maker_Camera_0123-video-index0");
  EXPECT_EQ(all[0].name, "vivid, /dev/video0");
  EXPECT_EQ(all[1].source, "v4l2:/dev/video1");
  EXPECT_TRUE(all[0].inputs.empty()) << "webcams have no inputs to choose from";
  for (const CameraListing& one : all) {
    EXPECT_EQ(one.rejection_reason, "");
    for (const char* pixels : {"yuyv", "nv12", "rgb8", "grey16", "bayer-gbrg8", "uyvy", "grey12", "V4L2 YVYU"}) {
      EXPECT_TRUE(std::any_of(one.formats.begin(), one.formats.end(), [&](const OfferedFormat& f) {
        return f.pixels == pixels && f.width == 640 && f.height == 360 && f.rate_hz >= 25.0;
      })) << pixels;
    }
    EXPECT_TRUE(std::any_of(one.controls.begin(), one.controls.end(),
                            [](const OfferedControl& c) { return c.name == "gain" && c.low == 0 && c.high == 255; }));
  }
}

class RecordedVivid : public test::ScratchFolder {};

TEST_F(RecordedVivid, ReplaysByteForByte) {
  for (const char* format : {"yuyv", "uyvy", "nv12", "bayer-grbg8", "rgb8", "grey10", "grey12"}) {
    const std::filesystem::path folder = folder_ / format;
    std::filesystem::create_directories(folder);
    std::ofstream(folder / "session.toml") << "format = 1\n[color]\nsource = \"v4l2:/dev/video0\"\npixel_format = \""
                                           << format << "\"\nwidth = " << kVividWidth << "\nheight = " << kVividHeight
                                           << "\nfx = 300\nfy = 300\ncx = 160\ncy = 90\nexposure = 2\n[tag]\nid = 1\n"
                                           << "size_m = 0.1\n";
    test::expect_identical_replay(folder, 6);
  }
}

}  // namespace
}  // namespace lumigraft::capture
