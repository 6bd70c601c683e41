// Conversion of a session's settings to libcamera's controls, and of frame metadata to exposure. Tested without a
// camera: the virtual cameras of tests/integration/camera_vm have no such metadata.
#include <gtest/gtest.h>

#include <string>

#include "capture/error.h"
#include "capture/live/libcamera/library.h"

namespace lumigraft::capture {
namespace {

namespace controls = libcamera::controls;

const libcamera::ControlInfoMap kOffered({{&controls::AeEnable, libcamera::ControlInfo(false, true)},
                                          {&controls::ExposureTime, libcamera::ControlInfo(100, 33'000)},
                                          {&controls::AnalogueGain, libcamera::ControlInfo(1.0f, 16.0f)},
                                          {&controls::FrameDurationLimits,
                                           libcamera::ControlInfo(std::int64_t{10'000}, std::int64_t{100'000})}},
                                         controls::controls);

TEST(LibcameraSettings, AutomaticControlsAreOffAndValuesAreSet) {
  CameraSettings settings;
  settings.exposure_us = 5000;
  settings.gain = 2;
  settings.rate_hz = 25;
  const libcamera::ControlList list = libcam::controls_for(kOffered, settings);
  EXPECT_EQ(list.get(controls::AeEnable), false);
  EXPECT_EQ(list.get(controls::ExposureTime), 5000);
  EXPECT_EQ(list.get(controls::AnalogueGain), 2.0f);
  EXPECT_FALSE(list.contains(controls::AwbEnable.id())) << "the camera has no such control";
  const auto limits_us = list.get(controls::FrameDurationLimits);
  ASSERT_TRUE(limits_us);
  EXPECT_EQ((*limits_us)[0], 40'000);
  EXPECT_EQ((*limits_us)[1], 40'000);
}

TEST(LibcameraSettings, ValuesOutOfRangeAreRefused) {
  CameraSettings settings;
  settings.exposure_us = 50'000;
  try {
    libcam::controls_for(kOffered, settings);
    FAIL() << "no error";
  } catch (const InputError& e) {
    EXPECT_STREQ(e.what(), "exposure_us: found 50000.000000, allowed: 100.000000 to 33000.000000");
  }
}

std::string settings_error(const libcamera::ControlInfoMap& offered, const CameraSettings& settings) {
  try {
    libcam::controls_for(offered, settings);
  } catch (const InputError& e) {
    return e.what();
  }
  return "no error";
}

TEST(LibcameraSettings, WhiteBalanceHasTwoGains) {
  const libcamera::ControlInfoMap offered({{&controls::AwbEnable, libcamera::ControlInfo(false, true)},
                                           {&controls::ColourGains, libcamera::ControlInfo(0.0f, 32.0f)}},
                                          controls::controls);
  CameraSettings settings;
  settings.controls = {{"ColourGains[Blue]", 1.5}, {"ColourGains[Red]", 1.75}};
  const libcamera::ControlList list = libcam::controls_for(offered, settings);
  EXPECT_EQ(list.get(controls::AwbEnable), false);
  const auto gains = list.get(controls::ColourGains);
  ASSERT_TRUE(gains);
  EXPECT_EQ((*gains)[0], 1.75f) << "red";
  EXPECT_EQ((*gains)[1], 1.5f) << "blue";
  EXPECT_EQ(settings_error(kOffered, settings).find("controls.ColourGains[Red]: found no such number"), 0u);
  settings.controls = {{"ColourGains[Blue]", 1.5}};
  EXPECT_EQ(settings_error(offered, settings),
            "controls.ColourGains[Blue]: found it alone, allowed: together with ColourGains[Red]");
  settings.controls = {{"ColourGains[Blue]", 40.0}, {"ColourGains[Red]", 1.75}};
  EXPECT_EQ(settings_error(offered, settings),
            "controls.ColourGains[Blue]: found 40.000000, allowed: 0.000000 to 32.000000");
  settings.controls = {{"ColourGains", 1.5}};
  EXPECT_EQ(settings_error(offered, settings).find("controls.ColourGains: found no such number"), 0u)
      << "libcamera would read a second number";
}

TEST(LibcameraSettings, AFramesSettingsAreThoseOfItsMetadata) {
  libcamera::ControlList metadata(controls::controls);
  EXPECT_FALSE(libcam::reported_in(metadata).exposure_us || libcam::reported_in(metadata).gain) << "no metadata";
  metadata.set(controls::ExposureTime, 2500);
  metadata.set(controls::AnalogueGain, 4.0f);
  EXPECT_EQ(libcam::reported_in(metadata).exposure_us, 2500.0);
  EXPECT_EQ(libcam::reported_in(metadata).gain, 4.0);
  metadata.set(controls::DigitalGain, 1.5f);
  EXPECT_EQ(libcam::reported_in(metadata).gain, 6.0) << "of the sensor times of the image processor";
  EXPECT_FALSE(libcam::reported_in(metadata).readout_s);
  metadata.set(controls::draft::SensorRollingShutterSkew, std::int64_t{21'000'000});
  EXPECT_DOUBLE_EQ(libcam::reported_in(metadata).readout_s.value(), 0.021);
  metadata.set(controls::draft::SensorRollingShutterSkew, std::int64_t{-1});
  EXPECT_FALSE(libcam::reported_in(metadata).readout_s);
}

}  // namespace
}  // namespace lumigraft::capture
