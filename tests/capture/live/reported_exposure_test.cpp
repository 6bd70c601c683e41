// Frame::exposure from what a camera reports of a frame.
#include "capture/live/reported_exposure.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace lumigraft::capture {
namespace {

TEST(ReportedExposure, ScalesTheSessionsExposure) {
  StreamSpec spec{.exposure = 3.0};
  spec.settings.exposure_us = 5000;
  spec.settings.gain = 2;
  ReportedExposure exposure(spec);
  EXPECT_DOUBLE_EQ(exposure.of_frame({}), 3.0) << "nothing is reported";
  EXPECT_DOUBLE_EQ(exposure.of_frame({2500, {}}), 1.5);
  EXPECT_DOUBLE_EQ(exposure.of_frame({2500, 8}), 6.0);
  EXPECT_DOUBLE_EQ(exposure.of_frame({5000, 2}), 3.0);
  EXPECT_EQ(exposure.take_warning(), "");
}

TEST(ReportedExposure, IsRelativeToTheFirstFrameWhereTheSessionStatesNothing) {
  ReportedExposure exposure(StreamSpec{.exposure = 3.0});
  EXPECT_DOUBLE_EQ(exposure.of_frame({10'000, 4}), 3.0);
  EXPECT_DOUBLE_EQ(exposure.of_frame({20'000, 2}), 3.0);
  EXPECT_DOUBLE_EQ(exposure.of_frame({20'000, 4}), 6.0);
}

TEST(ReportedExposure, DecibelsAreOfAmplitude) {
  StreamSpec spec{.exposure = 3.0};
  spec.settings.gain = 0;
  ReportedExposure exposure(spec, true);
  EXPECT_NEAR(exposure.of_frame({{}, 20}), 30.0, 1e-9);
  EXPECT_NEAR(exposure.of_frame({{}, -20}), 0.3, 1e-9) << "a negative number of decibels is possible";
}

TEST(ReportedExposure, ImpossibleNumbersAreIgnoredAndReportedOnce) {
  constexpr double kNan = std::numeric_limits<double>::quiet_NaN(), kInf = std::numeric_limits<double>::infinity();
  for (const double bad : {kNan, kInf, -kInf, 0.0, -1.0, 1e300, 1e-300}) {
    StreamSpec spec{.stream = Stream::fisheye, .exposure = 3.0};
    spec.settings.exposure_us = 5000;
    ReportedExposure exposure(spec);
    EXPECT_DOUBLE_EQ(exposure.of_frame({bad, {}}), 3.0) << bad << " in the first frame";
    const std::string warning = exposure.take_warning();
    EXPECT_EQ(warning.find("fish-eye: the camera reports the impossible exposure time (us) "), 0u) << warning;
    EXPECT_DOUBLE_EQ(exposure.of_frame({10'000, 2}), 6.0);
    EXPECT_DOUBLE_EQ(exposure.of_frame({bad, 2}), 6.0) << bad << ": that of the frame before is used";
    EXPECT_EQ(exposure.take_warning(), "") << bad;
    EXPECT_DOUBLE_EQ(exposure.of_frame({10'000, bad}), 6.0) << bad;
    EXPECT_EQ(exposure.take_warning().find("fish-eye: the camera reports the impossible gain "), 0u) << bad;
  }
}

}  // namespace
}  // namespace lumigraft::capture
