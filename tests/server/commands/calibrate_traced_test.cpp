// Calibration of path-traced boards, compared with the true lenses, poses and vignetting.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <vector>

#include "capture/camera/srgb.h"
#include "reconstruct/calibrate/extrinsics.h"
#include "reconstruct/calibrate/response.h"
#include "reconstruct/calibrate/vignetting.h"
#include "tests/server/commands/traced_boards.h"

namespace lumigraft::server {
namespace {

using namespace test;

constexpr capture::Vignetting kFalloff{{-0.24, 0.02, -0.022}};
constexpr int kSamples = 6;

Eigen::Isometry3d true_T_fisheye_color() {
  return Eigen::Translation3d(0.05, -0.03, 0.02) * Eigen::AngleAxisd(0.7, Eigen::Vector3d(0.3, 1, -0.2).normalized());
}

/// Both cameras' views of a board that is shown first to both, then all around the fish-eye.
struct Traced {
  std::vector<reconstruct::BoardPicture> color, fisheye;

  static const Traced& once() {
    static const Traced all;
    return all;
  }

 private:
  Traced() {
    const reconstruct::BoardFinder finder(test_board());
    const BoardTracer before_color(test_board(), distorted_pinhole(), Eigen::Isometry3d::Identity());
    const BoardTracer before_fisheye(test_board(), test_fisheye(), true_T_fisheye_color(), kFalloff);
    BoardSensor sensor;
    for (const Eigen::Isometry3d& pose : pinhole_poses(12)) {
      color.push_back(board_picture(finder, before_color.picture(pose, kSamples, sensor)));
      fisheye.push_back(board_picture(finder, before_fisheye.picture(pose, kSamples, sensor)));
      ++sensor.seed;
    }
    for (const Eigen::Isometry3d& pose : fisheye_poses()) {
      color.emplace_back();
      fisheye.push_back(
          board_picture(finder, before_fisheye.picture(true_T_fisheye_color().inverse() * pose, kSamples, sensor)));
      ++sensor.seed;
    }
  }
};

std::vector<reconstruct::BoardView> views_of(const std::vector<reconstruct::BoardPicture>& pictures) {
  std::vector<reconstruct::BoardView> views;
  for (const reconstruct::BoardPicture& picture : pictures) views.push_back(picture.view);
  return views;
}

void expect_honest(const reconstruct::CameraCalibration& found, const capture::CameraModel& truth) {
  const reconstruct::LensNumbers is = reconstruct::lens_numbers(found.model), was = reconstruct::lens_numbers(truth);
  for (std::size_t i = 0; i < reconstruct::kLensNumbers; ++i) EXPECT_NEAR(is[i], was[i], 3.5 * found.sigma[i]) << i;
}

TEST(CalibrateTraced, LensesPlacesAndFalloff) {
  const reconstruct::BoardFinder finder(test_board());
  std::vector<reconstruct::BoardPicture> color = Traced::once().color, fisheye = Traced::once().fisheye;

  const capture::CameraModel color_truth = distorted_pinhole();
  const reconstruct::CameraCalibration first =
      reconstruct::calibrate_camera(unknown_camera(color_truth), finder, color);
  EXPECT_EQ(first.refusal, "");
  std::printf("colour: focal length off by %.4f %%, principal point by %.3f px, picture by %.3f px; %.3f px median\n",
              100 * std::abs(first.model.fx / color_truth.fx - 1),
              std::hypot(first.model.cx - color_truth.cx, first.model.cy - color_truth.cy),
              farthest_apart_px(first.model, color_truth, 0), first.median_px);
  EXPECT_NEAR(first.model.fx, color_truth.fx, 0.002 * color_truth.fx);
  EXPECT_NEAR(first.model.fy, color_truth.fy, 0.002 * color_truth.fy);
  EXPECT_NEAR(first.model.cx, color_truth.cx, 0.5);
  EXPECT_NEAR(first.model.cy, color_truth.cy, 0.5);
  expect_honest(first, color_truth);

  const capture::CameraModel fisheye_truth = test_fisheye();
  const reconstruct::CameraCalibration second =
      reconstruct::calibrate_camera(unknown_camera(fisheye_truth), finder, fisheye);
  EXPECT_EQ(second.refusal, "");
  std::printf("fish-eye: focal length off by %.4f %%, principal point by %.3f px, to 85° by %.3f px; %.3f px median\n",
              100 * std::abs(second.model.fx / fisheye_truth.fx - 1),
              std::hypot(second.model.cx - fisheye_truth.cx, second.model.cy - fisheye_truth.cy),
              farthest_apart_px(second.model, fisheye_truth, 85 * kTestDegree), second.median_px);
  EXPECT_NEAR(second.model.fx, fisheye_truth.fx, 0.002 * fisheye_truth.fx);
  EXPECT_NEAR(second.model.cx, fisheye_truth.cx, 0.5);
  EXPECT_NEAR(second.model.cy, fisheye_truth.cy, 0.5);
  EXPECT_LT(farthest_apart_px(second.model, fisheye_truth, 85 * kTestDegree), 0.3);
  expect_honest(second, fisheye_truth);

  const reconstruct::ExtrinsicsCalibration extrinsics =
      reconstruct::calibrate_extrinsics(first.model, second.model, views_of(color), views_of(fisheye));
  EXPECT_EQ(extrinsics.refusal, "");
  const Eigen::Vector3d shift = extrinsics.T_second_first.translation() - true_T_fisheye_color().translation();
  const Eigen::AngleAxisd turn(
      Eigen::Matrix3d(extrinsics.T_second_first.linear() * true_T_fisheye_color().linear().transpose()));
  const Eigen::Vector3d turned = turn.angle() * turn.axis();
  std::printf("stand, %d moments: %.3f mm, %.4f°; in sigmas: shift %.1f %.1f %.1f, turn %.1f %.1f %.1f\n",
              extrinsics.moments, 1e3 * shift.norm(), turn.angle() / kTestDegree,
              shift.x() / extrinsics.shift_sigma_m.x(), shift.y() / extrinsics.shift_sigma_m.y(),
              shift.z() / extrinsics.shift_sigma_m.z(), turned.x() / extrinsics.turn_sigma_rad.x(),
              turned.y() / extrinsics.turn_sigma_rad.y(), turned.z() / extrinsics.turn_sigma_rad.z());
  EXPECT_LT(1e3 * shift.norm(), 1.0);
  EXPECT_LT(turn.angle(), 0.1 * kTestDegree);
  EXPECT_LT(shift.cwiseQuotient(extrinsics.shift_sigma_m).cwiseAbs().maxCoeff(), 3.5);
  EXPECT_LT(turned.cwiseQuotient(extrinsics.turn_sigma_rad).cwiseAbs().maxCoeff(), 3.5);

  const reconstruct::VignettingCalibration falloff = reconstruct::calibrate_vignetting(
      reconstruct::white_of(views_of(fisheye), second.model), 0.5 * fisheye_truth.fov_rad);
  EXPECT_EQ(falloff.refusal, "");
  double worst = 0;
  for (int degrees = 0; degrees <= 85; ++degrees)
    worst = std::max(worst, std::abs(falloff.vignetting.transmission(degrees * kTestDegree) /
                                         kFalloff.transmission(degrees * kTestDegree) -
                                     1));
  std::printf("falloff to 85°: off by %.2f %% at worst, %.2f %% (1 sigma) said; boards uneven by %.0f %%\n",
              100 * worst, 100 * falloff.widest_sigma, 100 * falloff.unevenness);
  EXPECT_LT(worst, 0.05);
  EXPECT_LT(worst, 3.5 * falloff.widest_sigma);
}

/// From linear to encoded, both in [0, 1].
using Curve = std::function<double(double)>;

/// Rec. 709's curve with a knee, as in camcorders.
double knee(double x) {
  const double y = x < 0.018 ? 4.5 * x : 1.099 * std::pow(x, 0.45) - 0.099;
  return (1 - std::exp(-2.2 * y)) / (1 - std::exp(-2.2));
}

capture::Image<float> middle_of(const capture::Image<float>& image) {
  capture::Image<float> out(image.width / 2, image.height / 2, 1);
  for (int y = 0; y < out.height; ++y)
    for (int x = 0; x < out.width; ++x) out.at(x, y) = image.at(x + image.width / 4, y + image.height / 4);
  return out;
}

/// Exposures with ratios of about 2.
constexpr std::array<double, 8> kUneven = {0.02, 0.045, 0.073, 0.192, 0.32, 0.557, 1.41, 2.43};
constexpr std::array<double, 8> kDoubling = {0.02, 0.04, 0.08, 0.16, 0.32, 0.64, 1.28, 2.56};

/// A static board; the sensor saturates at white.
std::vector<reconstruct::ExposedPicture> sweep_of(const capture::Image<float>& light,
                                                  const std::array<double, 8>& exposures, const Curve& curve,
                                                  double electrons) {
  std::vector<reconstruct::ExposedPicture> pictures;
  for (unsigned i = 0; i < 8; ++i) {
    reconstruct::ExposedPicture& picture = pictures.emplace_back();
    picture.exposure = exposures[i];
    picture.encoded = capture::Image<std::uint8_t>(light.width, light.height, 3);
    for (std::size_t c = 0; c < 3; ++c) {
      capture::Image<float> exposed = light;
      for (float& value : exposed.data) value *= static_cast<float>(picture.exposure);
      sense(exposed, {.electrons = electrons, .seed = 3 * i + static_cast<unsigned>(c)});
      for (std::size_t k = 0; k < exposed.data.size(); ++k)
        picture.encoded.data[3 * k + c] =
            static_cast<std::uint8_t>(std::lround(255 * curve(std::clamp(exposed.data[k], 0.0f, 1.0f))));
    }
  }
  return pictures;
}

/// Radiance computed from a reading, as the product does: response(value) / exposure, where the exposure is estimated
/// with the same response from a grey patch of known radiance. From pixel value 250 on, a reading is only a lower bound
/// (radiance.h).
TEST(CalibrateTraced, ResponseOfASweptBoard) {
  const BoardTracer tracer(test_board(), distorted_pinhole(), Eigen::Isometry3d::Identity());
  const capture::Image<float> light = middle_of(tracer.light(pinhole_poses(1).front(), 8, 1));
  struct Case {
    const char* name;
    Curve curve;
    double electrons;
    std::array<double, 8> exposures = kDoubling;
  };
  const auto srgb = [](double x) { return static_cast<double>(capture::linear_to_srgb(static_cast<float>(x))); };
  // Only exposures with unequal ratios distinguish a line from a curve with ripples.
  for (const auto& [name, curve, electrons, exposures] :
       {Case{"srgb", srgb, 14000}, Case{"srgb", srgb, 3500}, Case{"knee", knee, 14000}, Case{"knee", knee, 3500},
        Case{"linear", [](double x) { return x; }, 14000, kUneven}}) {
    const reconstruct::ResponseCalibration found =
        reconstruct::calibrate_response(sweep_of(light, exposures, curve, electrons));
    EXPECT_EQ(found.refusal, "") << name;
    const auto truth = [&curve](int code) {
      double low = 0, high = 1;
      for (int i = 0; i < 60; ++i) (255 * curve(0.5 * (low + high)) < code ? low : high) = 0.5 * (low + high);
      return low;
    };
    double worst = 0, factor = 1;
    for (std::size_t c = 0; c < 3; ++c) {
      const auto grey = static_cast<std::size_t>(std::lround(255 * curve(0.18)));
      const double exposure = found.linear[c][grey] / truth(static_cast<int>(grey));
      if (std::abs(exposure - 1) > std::abs(factor - 1)) factor = exposure;
      for (std::size_t z = 24; z < 250; ++z)
        worst = std::max(worst, std::abs(found.linear[c][z] / exposure / truth(static_cast<int>(z)) - 1));
    }
    std::printf("%s, %.0f electrons: radiance off by %.2f %% at worst; an exposure's unit by a factor of %.4f\n", name,
                electrons, 100 * worst, factor);
    EXPECT_LT(worst, 0.01) << name << ", " << electrons;
    EXPECT_NEAR(factor, 1, 0.02) << name << ", " << electrons;
  }
}

}  // namespace
}  // namespace lumigraft::server
