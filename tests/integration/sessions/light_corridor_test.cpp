// Lamps of a real corridor seen by a real fish-eye. LUMIGRAFT_EXTRA names a folder that contains data/ocam-corridor:
// one photograph with its published lens calibration.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <ctime>

#include "capture/session/session.h"
#include "capture/source.h"
#include "reconstruct/albedo/albedo.h"
#include "reconstruct/calibrate/pictures.h"
#include "reconstruct/fusion/fusion.h"
#include "reconstruct/light/light.h"
#include "reconstruct/pose/pose.h"
#include "tests/reconstruct/light/light_views.h"
#include "tests/reconstruct/real_data.h"

namespace lumigraft::reconstruct {
namespace {

// Scaramuzza's model: radius in pixels as a polynomial of the angle above the picture plane, lowest power first; centre
// in pixels.
constexpr std::array kRadius = {772.405470, 504.754051, 7.034666,  45.327180, 54.651570,
                                0.458049,   -7.873745,  15.588713, 13.743404, 2.968883};
constexpr double kCentreX = 798.175741, kCentreY = 794.308657;

double radius_px(double theta) {
  double sum = 0, power = 1;
  for (const double factor : kRadius) {
    sum += factor * power;
    power *= theta - std::numbers::pi / 2;
  }
  return sum;
}

/// The same lens as r = f (θ + k1 θ³ + ...), by least squares; `off_px` gets the maximum deviation.
capture::CameraModel lens(double& off_px) {
  constexpr int kSteps = 180;
  Eigen::MatrixXd powers(kSteps, 5);
  Eigen::VectorXd radius(kSteps);
  for (int i = 0; i < kSteps; ++i) {
    const double theta = (i + 1) * 0.5 * kDegree;
    for (int k = 0; k < 5; ++k) powers(i, k) = std::pow(theta, 2 * k + 1);
    radius[i] = radius_px(theta);
  }
  const Eigen::VectorXd f = powers.colPivHouseholderQr().solve(radius);
  off_px = (powers * f - radius).cwiseAbs().maxCoeff();
  capture::CameraModel camera;
  camera.kind = capture::CameraModel::Kind::kannala_brandt;
  camera.width = camera.height = 1600;
  camera.fx = camera.fy = f[0];
  camera.cx = kCentreX;
  camera.cy = kCentreY;
  for (int k = 0; k < 4; ++k) camera.k[k] = f[k + 1] / f[0];
  camera.fov_rad = std::numbers::pi;
  return camera;
}

// Positions of the ceiling spots and the start of the floor in the photograph, marked by hand. Exposed for the walls:
// the spots are clipped, and so is much of the polished floor below them, and the white paper of two printed tags on
// it.
constexpr std::array kSpots = {std::pair{981, 154}, std::pair{921, 281}, std::pair{1152, 231}, std::pair{797, 478},
                               std::pair{1380, 504}};
constexpr int kFloorBelow = 960;
// The far end of the corridor, with lamps of its own: a corner of this image.
constexpr int kFarEndRightOf = 1440, kFarEndBelow = 600;

TEST(LightCorridor, SpotsInTheCeiling) {
  const auto folder = test::data_folder("ocam-corridor");
  if (!folder) GTEST_SKIP() << "LUMIGRAFT_EXTRA names no folder with data/ocam-corridor";
  double off_px = 0;
  capture::Session session;
  session.fisheye.emplace();
  const capture::CameraModel& model = session.fisheye->model = lens(off_px);
  EXPECT_LT(off_px, 0.5);
  auto picture = std::make_shared<capture::Frame>(read_any_picture(*folder / "img0.jpg"));
  picture->stream = capture::Stream::fisheye;
  capture::FrameSet frame;
  frame.fisheye = {picture};
  LightStage stage(session);
  const auto result = stage.extract(frame);
  ASSERT_TRUE(result.illumination);
  ASSERT_FALSE(result.warnings.empty());
  EXPECT_NE(result.warnings.front().find("clipped"), std::string::npos) << "their power is unknown, and that is said";

  const auto& lamps = result.illumination->lights;
  double max_degrees = 0;
  for (const auto& [x, y] : kSpots) {
    const Eigen::Vector3f spot = model.unproject(Eigen::Vector2d(x, y))->cast<float>();
    double nearest = 180;
    for (const PointLight& lamp : lamps) nearest = std::min(nearest, angle_degrees(lamp.direction, spot));
    EXPECT_LT(nearest, 1) << x << " " << y;
    max_degrees = std::max(max_degrees, nearest);
  }
  int on_floor = 0, strong_on_floor = 0;
  for (std::size_t i = 0; i < lamps.size(); ++i) {
    EXPECT_TRUE(lamps[i].clipped);
    const Eigen::Vector2d at = *model.project(lamps[i].direction.cast<double>());
    if (at.y() >= kFloorBelow) {
      ++on_floor;
      strong_on_floor += i < 8;
      EXPECT_LT((at - Eigen::Vector2d(1180, 1255)).norm(), 60) << "no lamp, and no paper of a tag";
      continue;
    }
    const bool spot = std::any_of(kSpots.begin(), kSpots.end(), [&](const auto& marked) {
      return (at - Eigen::Vector2d(marked.first, marked.second)).norm() < 10;
    });
    EXPECT_TRUE(spot || (at.x() > kFarEndRightOf && at.y() > kFarEndBelow)) << "a lit wall at " << at.transpose();
  }
  std::printf("light: corridor, %zu spots, %.2f deg off at most; %zu lamps, of which %d are a tag's paper\n",
              kSpots.size(), max_degrees, lamps.size(), on_floor);
  EXPECT_LE(strong_on_floor, 3);
}

/// The same room as a session: all lamps clipped, and a polished floor.
TEST(LightCorridor, SpotsHangUnderTheCeiling) {
  const auto folder = test::data_folder("../sessions-real/corridor");
  if (!folder) GTEST_SKIP() << "LUMIGRAFT_EXTRA names no folder with sessions-real/corridor";
  const capture::Session session = capture::read_session(capture::ConfigTable::load(*folder / "session.toml"));
  const auto frame = capture::open_frames(session)->next(std::chrono::seconds(1));
  ASSERT_TRUE(frame);
  PoseStage locate(session.tag, session.color.model, session.color.response);
  const auto pose = locate.locate(*frame).pose;
  ASSERT_TRUE(pose);
  FusionStage fuse(session, {});
  const auto field = fuse.fuse(*frame, *pose);
  LightStage light(session);
  AlbedoStage solve(session);
  const std::clock_t start = std::clock();
  const auto result = solve.solve(*field, *light.extract(*frame).illumination);
  const double ms = 1e3 * static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
  int spots = 0;
  for (const PointLight& lamp : result.illumination->lights) {
    EXPECT_GT(lamp.direction.z(), 0) << "no lamp below the floor, and none on it";
    if (lamp.direction.z() < 0.4f) continue;  // the far end
    ++spots;
    ASSERT_TRUE(lamp.distance_known);
    // Shading on a polished floor determines their heights to 24 to 80 % only: a usual ceiling is within one sigma.
    const float above_m = lamp.position_m.z() - result.illumination->probe_position_m.z();
    const float factor = std::exp(lamp.distance_log_sigma);
    EXPECT_GT(lamp.position_m.z() + above_m * (factor - 1), 2) << lamp.direction.transpose();
    EXPECT_LT(lamp.position_m.z() + above_m * (1 / factor - 1), 3.5f) << lamp.direction.transpose();
    EXPECT_LT(factor, 2.5f) << "known to a factor of 2.5";
    EXPECT_LT(lamp.power_log_sigma, 1) << "of one kind";
  }
  EXPECT_EQ(spots, static_cast<int>(kSpots.size()));
  std::printf("light: corridor, %d spots, %zu lamps, %.0f CPU ms\n", spots, result.illumination->lights.size(), ms);
}

}  // namespace
}  // namespace lumigraft::reconstruct
