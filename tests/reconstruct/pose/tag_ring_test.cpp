// Images of a ring of four tags on a floor, of which each view shows two, and most not the first.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <vector>

#include "reconstruct/pose/pose.h"
#include "tests/reconstruct/pose/pose_room.h"
#include "tests/reconstruct/pose/tag_table.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;
using test::kDegree;
using test::kFrameNs;

const capture::Tag kRing{"tag36h11", 2, 0.16, {{5, 0.16, {}}, {7, 0.16, {}}, {9, 0.16, {}}}};
constexpr double kRadius_m = 0.4;
const Vector3d kMiddle(-kRadius_m, 0, 0);  ///< of the ring, in the frame of the first tag

Isometry3d place_of(std::size_t tag) {
  const double angle = M_PI / 2 * static_cast<double>(tag);
  return test::lying_at(kMiddle + kRadius_m * Vector3d(std::cos(angle), std::sin(angle), 0), 0.9 * angle);
}

/// Looks at the middle between two neighbours on the ring from `at` quarters of a turn on.
Isometry3d camera_at(double at) {
  const double angle = M_PI / 2 * at;
  const Vector3d aim = kMiddle + 0.75 * kRadius_m * Vector3d(std::cos(angle), std::sin(angle), 0);
  Isometry3d T = test::looking_at_tag(0.7, 35 * kDegree, angle);
  T.pretranslate(aim);
  return T;
}

bool shows_first(double at) {
  const capture::CameraModel camera = test::small_camera();
  for (const double x : {-0.08, 0.08})
    for (const double y : {-0.08, 0.08}) {
      const auto pixel = camera.project(camera_at(at).inverse() * Vector3d(x, y, 0));
      if (!pixel || pixel->minCoeff() < 0 || pixel->x() > camera.width - 1 || pixel->y() > camera.height - 1)
        return false;
    }
  return true;
}

capture::FrameSet view_of_ring(double at, std::uint64_t index) {
  const capture::CameraModel camera = test::small_camera();
  const TagFinder finder(kRing);
  const Isometry3d T = camera_at(at);
  std::array<capture::Frame, 4> views;
  for (std::size_t t = 0; t < 4; ++t)
    views[t] = test::view_of_tag(camera, finder.pattern(t), 0.16, place_of(t).inverse() * T,
                                 {1, static_cast<unsigned>(index) + 1});
  capture::Frame picture = views[0];
  for (int v = 0; v < camera.height; ++v)
    for (int u = 0; u < camera.width; ++u) {
      const Vector3d d = T.linear() * *camera.unproject({static_cast<double>(u), static_cast<double>(v)});
      const Vector3d p = T.translation() - T.translation().z() / d.z() * d;
      const auto off = [&](std::size_t t) { return (p - place_of(t).translation()).norm(); };
      const std::size_t nearest = std::ranges::min(std::array<std::size_t, 4>{0, 1, 2, 3}, {}, off);
      if (off(nearest) < 0.16)
        std::copy_n(&views[nearest].encoded.at(u, v), 3, &picture.encoded.at(u, v));
      else
        std::fill_n(&picture.encoded.at(u, v), 3, 130);
    }
  return test::frame_of(std::move(picture), index, static_cast<std::int64_t>(index) * kFrameNs);
}

TEST(TagRingViews, EveryPoseIsRightOrUnknown) {
  TestRoom bare;
  bare.half_m = 0.9f;
  const DistanceField floor = bare.field();
  // Twice around; with some frames between views, so that the whole image is searched in each.
  constexpr int kViews = 64;
  std::vector<capture::FrameSet> views;
  for (int i = 0; i < kViews; ++i) views.push_back(view_of_ring(8.0 * i / kViews, static_cast<std::uint64_t>(8 * i)));
  for (const bool with_depth : {false, true}) {
    PoseStage stage(kRing, test::small_camera());
    int right = 0, unknown = 0, reported = 0, without_first = 0;
    double max_mm = 0, max_degrees = 0;
    for (int i = 0; i < kViews; ++i) {
      const double at = 8.0 * i / kViews;
      capture::FrameSet frame = views[static_cast<std::size_t>(i)];
      if (with_depth)
        frame.depth = std::make_shared<capture::DepthFrame>(
            test::depth_of_room(bare, test::small_camera(), camera_at(at), static_cast<unsigned>(i) + 1, 1));
      const auto result = stage.locate(frame, with_depth ? &floor : nullptr);
      if (!result.pose || result.pose->from == Pose::From::past) {
        ++unknown;
        continue;
      }
      const Pose& pose = *result.pose;
      const double off_mm = test::millimetres_apart(pose.T_tag_camera_raw, camera_at(at));
      const double degrees = test::degrees_apart(pose.T_tag_camera_raw, camera_at(at));
      const bool wrong = off_mm > std::max(10.0, 4e3 * position_sigma_m(pose.covariance)) || degrees > 1;
      if (wrong) {
        ++reported;
        EXPECT_FALSE(result.warnings.empty()) << "view " << i << ": " << off_mm << " mm off in silence";
        EXPECT_LT(off_mm, 30) << i;
        continue;
      }
      ++right;
      without_first += !shows_first(at);
      max_mm = std::max(max_mm, off_mm);
      max_degrees = std::max(max_degrees, degrees);
    }
    std::printf(
        "pose: ring of tags %s: %d right (at most %.1f mm, %.2f deg off; %d without the first), %d unknown, %d "
        "wrong and reported\n",
        with_depth ? "over a floor" : "without depth", right, max_mm, max_degrees, without_first, unknown, reported);
    EXPECT_GT(right, 40);
    EXPECT_EQ(reported, 0);
    EXPECT_GT(without_first, 8);
  }
}

}  // namespace
}  // namespace lumigraft::reconstruct
