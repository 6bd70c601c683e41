// A frame grabber with an HDMI input, emulated by the kernel's virtual camera vivid.
#include <gtest/gtest.h>

#include <chrono>
#include <string>
#include <vector>

#include "capture/error.h"
#include "capture/live/camera_list.h"
#include "capture/live/live_source.h"
#include "capture/live/v4l2/source.h"
#include "tests/integration/camera_vm/vivid_camera.h"

namespace lumigraft::capture {
namespace {

using namespace std::chrono_literals;
using test::kGrabber;
using test::Vivid;

/// Signal at the grabber's input, by the driver's names.
enum class Signal { as_set = 0, none = 1, unsteady = 2, beyond = 3, selected = 4 };

StreamSpec spec_of(int width, int height, const char* input = "HDMI 0") {
  StreamSpec spec{.stream = Stream::color, .width = width, .height = height};
  spec.settings.input = input;
  return spec;
}

class VividGrabber : public testing::Test {
 protected:
  /// Selects the input that the controls of the second handle refer to.
  void SetUp() override {
    ASSERT_TRUE(hand_.open());
    ASSERT_TRUE(hand_.choose_input("HDMI 0"));
    ASSERT_TRUE(plug("640x480p59"));
  }
  void TearDown() override {
    EXPECT_TRUE(see(Signal::as_set));
    EXPECT_TRUE(hand_.choose_input("Webcam 0"));
  }
  bool see(Signal signal) const { return hand_.set("DV Timings Signal Mode", static_cast<int>(signal)); }
  bool plug(const std::string& timings) const { return hand_.choose("DV Timings", timings) && see(Signal::selected); }
  static std::string error(const StreamSpec& spec) {
    try {
      const V4l2Source source(kGrabber, spec);
    } catch (const CameraFault& e) {
      return std::string("fault: ") + e.what();
    } catch (const InputError& e) {
      return std::string("error: ") + e.what();
    }
    return "no error";
  }
  static void wait_for_fault(LiveSource& source, const std::string& says) {
    for (const auto begin = std::chrono::steady_clock::now(); std::chrono::steady_clock::now() - begin < 10s;) {
      if (source.fault().find(says) != std::string::npos) {
        return;
      }
      source.next(10ms);
    }
    ADD_FAILURE() << "no fault \"" << says << "\" but \"" << source.fault() << '"';
  }

  /// Time until frames arrive again.
  static std::chrono::nanoseconds wait_for_frame(LiveSource& source) {
    const auto begin = std::chrono::steady_clock::now();
    while (std::chrono::steady_clock::now() - begin < 10s) {
      const auto item = source.next(50ms);
      if (item && std::holds_alternative<Frame>(*item) && source.fault().empty()) {
        return std::chrono::steady_clock::now() - begin;
      }
    }
    ADD_FAILURE() << "no picture: " << source.fault();
    return 10s;
  }

  Vivid hand_{kGrabber};
};

TEST_F(VividGrabber, DeliversTheSignalAtSixtyHz) {
  V4l2Source source(kGrabber, spec_of(640, 480));
  std::vector<std::int64_t> times_ns;
  std::uint64_t first = 0, last = 0;
  while (times_ns.size() < 20) {
    const auto item = source.next(3000ms);
    const auto* picture = item ? std::get_if<Frame>(&*item) : nullptr;
    ASSERT_NE(picture, nullptr) << source.fault();
    EXPECT_EQ(picture->encoded.width, 640);
    EXPECT_EQ(picture->encoded.height, 480);
    first = times_ns.empty() ? picture->stamp.sequence : first;
    last = picture->stamp.sequence;
    times_ns.push_back(picture->stamp.time_ns);
  }
  EXPECT_NEAR(1e-6 * static_cast<double>(times_ns.back() - times_ns.front()) / static_cast<double>(last - first),
              1000.0 / 59.94, 1.0)
      << "ms per sequence number, lost frames included";
}

/// BT.709 YUV, which most HDMI signals use, would be misread; RGB is not.
TEST_F(VividGrabber, ChoosesAFormatWithCorrectColours) {
  ASSERT_TRUE(hand_.set("Y'CbCr Encoding", 2));
  StreamSpec spec = spec_of(640, 480);
  spec.settings.controls = {{"osd_text_mode", 2}};
  auto source = std::make_unique<V4l2Source>(kGrabber, spec);
  const auto item = source->next(3000ms);
  const auto* picture = item ? std::get_if<Frame>(&*item) : nullptr;
  ASSERT_NE(picture, nullptr) << source->fault();
  source.reset();
  const int yellow[] = {191, 191, 0};
  for (int c = 0; c < 3; ++c) {
    EXPECT_NEAR(picture->encoded.at(640 * 3 / 16, 240, c), yellow[c], 3) << c;
  }
  spec.settings.pixel_format = PixelFormat::yuyv;
  EXPECT_NE(error(spec).find("found yuyv of another kind than BT.601"), std::string::npos) << error(spec);
  EXPECT_TRUE(hand_.set("Y'CbCr Encoding", 0));
}

TEST_F(VividGrabber, WithoutASignalItSaysSoAndIsLiveOnceThereIsOne) {
  const auto open = [] { return std::make_unique<V4l2Source>(kGrabber, spec_of(640, 480)); };
  LiveSource source("colour", open);
  wait_for_frame(source);
  ASSERT_TRUE(see(Signal::none));
  wait_for_fault(source, "colour: v4l2:platform:vivid-002: found no signal at its input \"HDMI 0\"");
  ASSERT_TRUE(see(Signal::unsteady));
  wait_for_fault(source, "found a signal that is not steady at its input");
  ASSERT_TRUE(see(Signal::beyond));
  wait_for_fault(source, "found a signal that the camera does not support at its input");
  ASSERT_TRUE(plug("640x480p59"));
  EXPECT_LT(wait_for_frame(source), 2s);
  ASSERT_TRUE(plug("1280x720p30"));
  wait_for_fault(source,
                 "found a signal of 1280x720 at 30 Hz at its input \"HDMI 0\", allowed by the session: 640x480");
  ASSERT_TRUE(plug("640x480p59"));
  EXPECT_LT(wait_for_frame(source), 2s);
}

TEST_F(VividGrabber, AnUnknownInputIsRefused) {
  EXPECT_EQ(error(spec_of(640, 480, "HDMI 7")),
            "error: v4l2:platform:vivid-002: input: found \"HDMI 7\", allowed: \"Webcam 0\", \"HDMI 0\"");
  EXPECT_EQ(error(spec_of(640, 360, "Webcam 0")), "no error");
}

TEST_F(VividGrabber, KeepsItsInputIfNoneIsNamed) {
  StreamSpec spec = spec_of(640, 480);
  spec.settings.input.reset();
  spec.settings.rate_hz = 30.0;
  EXPECT_NE(error(spec).find("rate_hz: found a camera that gives 59.94"), std::string::npos)
      << "the rate is the signal's: " << error(spec);
}

TEST_F(VividGrabber, IsListedWithInputsAndSignal) {
  const auto inputs = [] {
    for (const CameraListing& one : list_v4l2_cameras()) {
      if (!one.inputs.empty()) {
        return one.inputs;
      }
    }
    return std::vector<OfferedInput>();
  };
  const auto now = inputs();
  ASSERT_EQ(now.size(), 2u);
  EXPECT_EQ(now[0].name, "Webcam 0");
  EXPECT_FALSE(now[0].chosen);
  EXPECT_EQ(now[1].name, "HDMI 0");
  EXPECT_TRUE(now[1].chosen);
  EXPECT_EQ(now[1].signal, "640x480 at 59.94 Hz");
  ASSERT_TRUE(see(Signal::none));
  EXPECT_EQ(inputs()[1].signal, "no signal");
}

}  // namespace
}  // namespace lumigraft::capture
