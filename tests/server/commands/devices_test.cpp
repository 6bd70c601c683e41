#include "server/commands/devices.h"

#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <sstream>

namespace lumigraft::server {
namespace {

const std::vector<capture::CameraListing> kTwo = {
    {.source = "aravis:A-1",
     .name = "A 1",
     .formats = {{"bayer-rggb8", 2048, 1024, 30.5}},
     .controls = {{"gain", 0, 10, 2.5}, {"exposure", NAN, NAN, 7}}},
    {.source = "openni2:u", .name = "broken \xff name", .rejection_reason = "in use"}};

TEST(Devices, AsText) {
  std::ostringstream out;
  write_devices_text(out, kTwo);
  EXPECT_EQ(out.str(),
            "aravis:A-1  A 1\n  bayer-rggb8 2048x1024 at up to 30.5 Hz\n  gain = 2.5  (0 to 10)\n  exposure = 7\n"
            "openni2:u  broken \xff name\n  cannot be looked into: in use\n");
  std::ostringstream none;
  write_devices_text(none, {});
  EXPECT_EQ(none.str(), "no cameras found\n");
}

TEST(Devices, AsJson) {
  std::ostringstream out;
  write_devices_json(out, kTwo);
  const auto json = nlohmann::json::parse(out.str());
  ASSERT_EQ(json.size(), 2u);
  EXPECT_EQ(json[0]["source"], "aravis:A-1");
  EXPECT_EQ(json[0]["formats"][0],
            (nlohmann::json{{"pixel_format", "bayer-rggb8"}, {"width", 2048}, {"height", 1024}, {"rate_hz", 30.5}}));
  EXPECT_EQ(json[0]["controls"][0], (nlohmann::json{{"name", "gain"}, {"low", 0.0}, {"high", 10.0}, {"value", 2.5}}));
  EXPECT_EQ(json[0]["controls"][1],
            (nlohmann::json{{"name", "exposure"}, {"low", nullptr}, {"high", nullptr}, {"value", 7.0}}));
  EXPECT_FALSE(json[0].contains("why_not"));
  EXPECT_EQ(json[1]["why_not"], "in use");
}

TEST(Devices, InputsOfAFrameGrabber) {
  const std::vector<capture::CameraListing> grabber = {
      {.source = "v4l2:g", .name = "G", .inputs = {{"SDI 1", false, ""}, {"HDMI 1", true, "no signal"}}}};
  std::ostringstream text, json_text;
  write_devices_text(text, grabber);
  EXPECT_EQ(text.str(), "v4l2:g  G\n  input \"SDI 1\"\n  input \"HDMI 1\", chosen: no signal\n");
  write_devices_json(json_text, grabber);
  EXPECT_EQ(nlohmann::json::parse(json_text.str())[0]["inputs"],
            (nlohmann::json{{{"name", "SDI 1"}, {"chosen", false}, {"signal", ""}},
                            {{"name", "HDMI 1"}, {"chosen", true}, {"signal", "no signal"}}}));
}

TEST(Devices, OneCameraOfTwoLibrariesIsSaidToBeOne) {
  std::vector<capture::CameraListing> cameras = {
      {.source = "v4l2:webcam", .name = "W", .nodes = {"/dev/video2"}},
      {.source = "v4l2:other", .name = "O", .nodes = {"/dev/video0"}},
      {.source = "libcamera:w", .name = "W", .nodes = {"/dev/video2", "/dev/video3"}},
      {.source = "aravis:A-1", .name = "A 1"}};
  capture::find_same_hardware(cameras);
  std::ostringstream text, json_text;
  write_devices_text(text, cameras);
  EXPECT_EQ(text.str(),
            "v4l2:webcam  W\n  the same hardware as libcamera:w\nv4l2:other  O\n"
            "libcamera:w  W\n  the same hardware as v4l2:webcam\naravis:A-1  A 1\n");
  write_devices_json(json_text, cameras);
  const auto json = nlohmann::json::parse(json_text.str());
  EXPECT_EQ(json[0]["same_hardware"], nlohmann::json::array({"libcamera:w"}));
  EXPECT_FALSE(json[1].contains("same_hardware"));
  EXPECT_EQ(json[2]["same_hardware"], nlohmann::json::array({"v4l2:webcam"}));
}

}  // namespace
}  // namespace lumigraft::server
