// Poses on real pictures: a room without a tag (7-Scenes, red kitchen), and photographs of tags with known corners.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "capture/formats/picture_file.h"
#include "capture/source.h"
#include "reconstruct/fusion/fusion.h"
#include "reconstruct/pose/depth_tracking.h"
#include "reconstruct/pose/pose.h"
#include "reconstruct/room/mirror_detection.h"
#include "tests/reconstruct/pose/pose_views.h"
#include "tests/reconstruct/real_data.h"
#include "tests/reconstruct/seven_scenes.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Isometry3d;

/// Median distance in mm of a depth picture's points from a field's surface; points in unknown space are left out.
double median_off_mm(const DepthGrid& grid, const DistanceField& field, const Isometry3d& T_tag_camera) {
  std::vector<float> off;
  for (const DepthGrid::Point& point : grid.points) {
    if (point.position.z() == 0) continue;
    if (const auto slope = field.slope(T_tag_camera.cast<float>() * point.position))
      off.push_back(std::abs(slope->distance_m));
  }
  if (off.empty()) return 0;
  std::nth_element(off.begin(), off.begin() + static_cast<std::ptrdiff_t>(off.size() / 2), off.end());
  return 1e3 * static_cast<double>(off[off.size() / 2]);
}

// A Kinect moved through a kitchen at 3 Hz: 7 cm and 4° between frames. The first pose is given; the others follow from
// depth tracking against the field fused so far.
TEST(PoseReal, AKitchenWithoutATag) {
  const auto folder = test::data_folder("redkitchen/data");
  if (!folder) GTEST_SKIP() << "LUMIGRAFT_EXTRA names no folder with data/redkitchen";
  capture::Session session;
  session.color.model = test::seven_scenes_camera();
  FusionSettings settings;
  settings.voxel_m = 0.016;
  FusionStage fusion(session, settings), fusion_given(session, settings);
  const DepthSampler sampler(session.color.model);
  std::shared_ptr<const DistanceField> field_given;
  double surface_mm = 0, surface_given_mm = 0;
  DepthTracking carry(session.color.model);
  std::shared_ptr<const DistanceField> field;
  const auto gray = std::make_shared<const capture::Frame>();
  Isometry3d T_world_first = Isometry3d::Identity();
  double max_mm = 0, max_degrees = 0, way_m = 0, cpu_ms = 0;
  std::vector<double> off_mm;
  Isometry3d before = Isometry3d::Identity();
  constexpr int kPictures = 40;
  for (int i = 0; i < kPictures; ++i) {
    const auto read = test::seven_scenes_frame(*folder, static_cast<unsigned>(10 * i));
    ASSERT_TRUE(read) << i;
    capture::FrameSet frame = read->frame;
    frame.color = gray;
    frame.time_ns = i * 333'333'333ll;
    const Isometry3d& T_world_camera = read->T_world_camera;
    if (i == 0) T_world_first = T_world_camera;
    const Isometry3d truth = T_world_first.inverse() * T_world_camera;
    PoseEstimate pose;
    if (i == 0) {
      pose.T_tag_camera = carry.tag_seen(frame, pose, nullptr);
      carry.set_displayed(pose.T_tag_camera);
    } else {
      const std::clock_t start = std::clock();
      const auto carried = carry.track(frame, *field);
      cpu_ms += 1e3 * static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC / (kPictures - 1);
      ASSERT_TRUE(carried) << "picture " << i;
      pose = *carried;
    }
    way_m += (truth.translation() - before.translation()).norm();
    before = truth;
    off_mm.push_back(test::millimetres_apart(pose.T_tag_camera, truth));
    max_mm = std::max(max_mm, off_mm.back());
    max_degrees = std::max(max_degrees, test::degrees_apart(pose.T_tag_camera, truth));
    if (i > 0) {
      const DepthGrid grid = sampler.sample(frame.depth->depth_m);
      surface_mm += median_off_mm(grid, *field, pose.T_tag_camera) / (kPictures - 1);
      surface_given_mm += median_off_mm(grid, *field_given, truth) / (kPictures - 1);
    }
    Pose fused;
    fused.T_tag_camera = pose.T_tag_camera;
    field = fusion.fuse(frame, fused);
    fused.T_tag_camera = truth;
    field_given = fusion_given.fuse(frame, fused);
  }
  std::sort(off_mm.begin(), off_mm.end());
  std::printf(
      "pose: kitchen without a tag, %.1f m in %d pictures: median %.0f mm, at most %.0f mm and %.1f deg from the "
      "given poses, %.1f %% of the way; points off the surface so far %.1f mm, by the given poses %.1f mm; "
      "%.1f CPU ms a picture\n",
      way_m, kPictures, off_mm[off_mm.size() / 2], max_mm, max_degrees, 0.1 * max_mm / way_m, surface_mm,
      surface_given_mm, cpu_ms);
  const std::vector<RoomPoint> points = room_points(*field);
  const auto mirrors = mirror_warnings(points, *field, find_reflecting_planes(points, *field, MetalMask({})));
  EXPECT_TRUE(mirrors.empty()) << "doors and windows, no mirror: " << mirrors.front();
  EXPECT_LT(surface_mm, surface_given_mm) << "or the given poses would explain the surface better";
  EXPECT_LT(off_mm[off_mm.size() / 2], 40);
  EXPECT_LT(max_mm, 0.04 * 1e3 * way_m);
  EXPECT_LT(max_degrees, 4);
}

// The same capture, a second at a time: depth images aligned to each other contradict the given poses by more than they
// contradict themselves, so that these cannot judge a carried pose more finely.
TEST(PoseReal, HowFarTheKitchensPosesAreKnown) {
  const auto folder = test::data_folder("redkitchen/data");
  if (!folder) GTEST_SKIP() << "LUMIGRAFT_EXTRA names no folder with data/redkitchen";
  capture::Session session;
  session.color.model = test::seven_scenes_camera();
  FusionSettings settings;
  settings.voxel_m = 0.016;
  const DepthSampler sampler(session.color.model);
  constexpr unsigned kStep = 10, kSteps = 3;  // frames; a third of a second each
  std::vector<double> off_mm, closure_mm, residual_mm, given_residual_mm;
  for (unsigned first = 0; first < 970; first += kStep * kSteps) {
    std::vector<test::PosedFrame> frames;
    std::vector<std::shared_ptr<const DistanceField>> fields;
    for (unsigned k = 0; k <= kSteps; ++k) {
      const auto read = test::seven_scenes_frame(*folder, first + k * kStep);
      ASSERT_TRUE(read) << first;
      frames.push_back(*read);
      frames.back().frame.color = std::make_shared<const capture::Frame>();
      fields.push_back(FusionStage(session, settings).fuse(frames.back().frame, Pose{}));
    }
    const auto given = [&](std::size_t a, std::size_t b) {
      return frames[a].T_world_camera.inverse() * frames[b].T_world_camera;
    };
    const auto aligned = [&](std::size_t a, std::size_t b) -> std::optional<Isometry3d> {
      PoseEstimate start;
      start.T_tag_camera = given(a, b);
      start.covariance = 1e-3 * PoseCovariance::Identity();  // 3 cm, 2 degrees
      const auto pose = DepthTracking(session.color.model).restart(frames[b].frame, start, fields[a].get());
      return pose ? std::optional(pose->T_tag_camera) : std::nullopt;
    };
    const auto direct = aligned(0, kSteps);
    std::optional<Isometry3d> chained = Isometry3d::Identity();
    for (std::size_t k = 0; k < kSteps; ++k) {
      const auto step = aligned(k, k + 1);
      chained = chained && step ? std::optional(*chained * *step) : std::nullopt;
    }
    if (!direct || !chained) continue;
    off_mm.push_back(test::millimetres_apart(*direct, given(0, kSteps)));
    closure_mm.push_back(test::millimetres_apart(*direct, *chained));
    const DepthGrid grid = sampler.sample(frames.back().frame.depth->depth_m);
    residual_mm.push_back(median_off_mm(grid, *fields.front(), *direct));
    given_residual_mm.push_back(median_off_mm(grid, *fields.front(), given(0, kSteps)));
  }
  ASSERT_GT(off_mm.size(), 15u);
  const auto median = [](std::vector<double>& values) {
    std::sort(values.begin(), values.end());
    return values[values.size() / 2];
  };
  const double off = median(off_mm), closure = median(closure_mm);
  const double residual = median(residual_mm), given_residual = median(given_residual_mm);
  std::printf(
      "pose: kitchen, %zu seconds aligned by depth: %.1f mm in the median, 90 %% %.1f mm from the given poses, closure "
      "over three steps %.1f mm; points off the other image's surface %.2f mm, by the given poses %.2f mm\n",
      off_mm.size(), off, off_mm[off_mm.size() * 9 / 10], closure, residual, given_residual);
  EXPECT_LT(closure, off);
  EXPECT_LT(residual, given_residual);
}

// Photographs of a 65 mm tag rotated by hand, from a fish-eye, rectified.
TEST(PoseReal, ATagOnATurntable) {
  const auto folder = test::data_folder("apriltag-images/duckietown");
  if (!folder) GTEST_SKIP() << "LUMIGRAFT_EXTRA names no folder with data/apriltag-images";
  capture::CameraModel camera;
  camera.width = 1056;
  camera.height = 792;
  camera.fx = 329.8729619143081;
  camera.fy = 332.94611303946357;
  camera.cx = 528;
  camera.cy = 396;
  std::optional<Isometry3d> T_camera_front;
  double max_degrees = 0, max_mm = 0, max_px = 0;
  for (const int degrees : {0, -60, -30, 30, 60}) {
    capture::Frame picture;
    picture.encoded = capture::read_encoded(*folder / ("test_image_rotation_" + std::to_string(degrees) + ".png"));
    PoseStage stage({"tag36h11", 76, 0.065}, camera);
    const auto result = stage.locate(test::frame_of(std::move(picture), 0, 0));
    ASSERT_TRUE(result.pose) << degrees;
    const Isometry3d T_camera_tag = result.pose->T_tag_camera.inverse();
    if (!T_camera_front) T_camera_front = T_camera_tag;
    const double turned = test::degrees_apart(*T_camera_front, T_camera_tag);
    max_degrees = std::max(max_degrees, std::abs(turned - std::abs(degrees)));
    // The rotation axis may differ from the tag's centre line: only the distance is compared.
    max_mm = std::max(max_mm, 1e3 * std::abs(T_camera_tag.translation().z() - T_camera_front->translation().z()));
    max_px = std::max(max_px, result.pose->reprojection_error_px);
  }
  std::printf(
      "pose: photographed tag on a turntable: %.3f m away, turns off by %.2f deg at most, distance by %.1f mm; "
      "corners by %.2f px\n",
      T_camera_front->translation().norm(), max_degrees, max_mm, max_px);
  EXPECT_LT(max_degrees, 4);
}

// Two printed tags on a floor, photographed by a calibrated fish-eye. The floor's plane follows from both tags.
TEST(PoseReal, ATagOnTheFloorOfACorridorIsAsLevelAsTheFloor) {
  const char* extra = std::getenv("LUMIGRAFT_EXTRA");
  const auto folder = std::filesystem::path(extra ? extra : "") / "sessions-real/corridor";
  if (!extra || !std::filesystem::exists(folder / "expected.json"))
    GTEST_SKIP() << "LUMIGRAFT_EXTRA names no folder with sessions-real/corridor";
  const capture::Session session = capture::read_session(capture::ConfigTable::load(folder / "session.toml"));
  const auto expected = nlohmann::json::parse(std::ifstream(folder / "expected.json"))["T_tag_color"];
  Isometry3d truth = Isometry3d::Identity();
  for (int r = 0; r < 4; ++r)
    for (int c = 0; c < 4; ++c)
      truth.matrix()(r, c) = expected[static_cast<std::size_t>(r)][static_cast<std::size_t>(c)];
  auto frame = capture::open_frames(session)->next(std::chrono::seconds(1));
  ASSERT_TRUE(frame);
  const auto tilt = [&](const Isometry3d& T_tag_camera) {
    const Eigen::Vector3d up = Eigen::Vector3d::UnitZ();
    return std::acos((T_tag_camera.linear().transpose() * up).dot(truth.linear().transpose() * up)) / test::kDegree;
  };
  const auto with = PoseStage(session.tag, session.color.model, session.color.response).locate(*frame).pose;
  frame->depth = nullptr;
  const auto without = PoseStage(session.tag, session.color.model, session.color.response).locate(*frame).pose;
  ASSERT_TRUE(with && without);
  const double off_m = (with->T_tag_camera.translation() - truth.translation()).norm();
  std::printf(
      "pose: tag on the floor of a corridor: tilted by %.2f deg by its print, %.2f deg with depth; %.1f mm off\n",
      tilt(without->T_tag_camera), tilt(with->T_tag_camera), 1e3 * off_m);
  EXPECT_LT(tilt(with->T_tag_camera), 1);
  EXPECT_LT(off_m, 0.03);
  EXPECT_LT(off_m, 3 * position_sigma_m(with->covariance));
}

}  // namespace
}  // namespace lumigraft::reconstruct
