// Shadows of unobserved surfaces, and dark paint.
#include "reconstruct/albedo/unobserved_occluders.h"

#include <gtest/gtest.h>

#include <cmath>

#include "reconstruct/albedo/albedo.h"
#include "tests/reconstruct/albedo/albedo_room.h"
#include "tests/reconstruct/pose/pose_room.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Vector3f;

constexpr float kUnseenFrom_m = 0.04f;  ///< behind the front of a box

/// A tall box seen from its front only: its sides, along which the camera looks, and its back are unobserved. A lamp on
/// its left throws its shadow to the right. Left of it a square is painted as dark as the shadow.
struct HalfSeenBox {
  TestRoom room;
  TestBox box{{-0.05f, -0.05f, 0}, {0.05f, 0.15f, 0.3f}};
  Vector3f in_shadow{0.15f, 0.05f, 0}, on_paint{-0.35f, -0.3f, 0}, elsewhere{0.3f, -0.4f, 0};

  HalfSeenBox() {
    room.half_m = 0.7f;
    room.boxes = {box};
    room.probe = {-0.2f, -0.35f, 0.03f};
    room.lamps = {{{-1.2f, 0.05f, 1.0f}, {2.4f, 2.0f, 1.6f}, 0.04f}};
    room.ambient = Vector3f(0.08f, 0.09f, 0.1f);
    room.albedo = [paint = on_paint](const Vector3f& p) -> Vector3f {
      const bool dark = (p - paint).cwiseAbs().maxCoeff() < 0.08f;
      return dark ? Vector3f(0.15f, 0.14f, 0.13f) : Vector3f(0.5f, 0.45f, 0.4f);
    };
    room.seen = [this](const Vector3f& p) {
      return box.distance(p) > kUnseenFrom_m || p.z() < kUnseenFrom_m || p.z() > box.high.z() - kUnseenFrom_m ||
             p.y() < box.low.y() + kUnseenFrom_m;
    };
  }
  /// As seen from some places.
  DistanceField field(const std::vector<Vector3f>& eyes = {{0, -0.9f, 0.5f}}) const {
    DistanceField result = room.field();
    for (const Vector3f& eye : eyes) {
      Eigen::Isometry3d T_tag_camera = Eigen::Isometry3d::Identity();
      const Eigen::Vector3d z = (Eigen::Vector3d(0, 0, 0.1) - eye.cast<double>()).normalized();
      const Eigen::Vector3d x = z.cross(Eigen::Vector3d::UnitZ()).normalized();
      T_tag_camera.linear() << x, z.cross(x), z;
      T_tag_camera.translation() = eye.cast<double>();
      const capture::CameraModel camera = test::small_camera();
      const capture::DepthFrame depth = test::depth_of_room(room, camera, T_tag_camera, 0, 0);
      std::vector<Eigen::Vector2f> rays;
      std::vector<float> inverse;
      for (int v = 0; v < camera.height; ++v) {
        for (int u = 0; u < camera.width; ++u) {
          const Eigen::Vector3d ray = *camera.unproject({static_cast<double>(u), static_cast<double>(v)});
          rays.push_back((ray.head<2>() / ray.z()).cast<float>());
          inverse.push_back(depth.depth_m.at(u, v) > 0 ? 1 / depth.depth_m.at(u, v) : 0.0f);
        }
      }
      result.seen_space.push_back(
          std::make_shared<const SeenSpace>(rays, inverse, camera.width, T_tag_camera.cast<float>(), result.voxel_m));
    }
    return result;
  }
};

TEST(UnobservedOccluders, ShadowsOfUnseenSidesAreSeparatedFromPaint) {
  const HalfSeenBox half;
  AlbedoStage stage{capture::Session()};
  const auto result = stage.solve(half.field(), half.room.illumination());
  const auto off = [&](const Vector3f& p) {
    const auto [albedo, sigma] = albedo_at(*result.albedo, p);
    EXPECT_GE(sigma, 0);
    return (albedo - half.room.albedo(p)).cwiseAbs().mean();
  };
  EXPECT_LT(off(half.elsewhere), 0.03f);
  EXPECT_LT(off(half.in_shadow), 0.06f);
  EXPECT_LT(off(half.on_paint), 0.03f);
}

TEST(UnobservedOccluders, NoneWhereCamerasSawThroughTheSpace) {
  HalfSeenBox half;
  const TestBox box = half.room.boxes[0];
  half.room.boxes.clear();  // for the cameras: they look through where the box is
  DistanceField seen = half.field({{0.9f, 0.05f, 0.4f}, {-0.9f, 0.05f, 0.4f}});
  half.room.boxes = {box};
  DistanceField field = half.field();
  field.seen_space.insert(field.seen_space.end(), seen.seen_space.begin(), seen.seen_space.end());
  AlbedoStage stage{capture::Session()};
  const auto result = stage.solve(field, half.room.illumination());
  EXPECT_LT(albedo_at(*result.albedo, half.in_shadow).first.mean(), 0.3f)
      << "no occluder was observed there: the floor is dark";
}

/// A board that the camera sees edge-on, with a warm lamp on its left and a cold one on its right: the floor of each
/// side is in the shadow of the other side's lamp.
HalfSeenBox board_between_two_lamps() {
  HalfSeenBox scene;
  scene.box = {{-0.004f, -0.15f, 0}, {0.004f, 0.65f, 0.4f}};
  scene.room.boxes = {scene.box};
  scene.room.lamps = {{{-0.9f, 0.1f, 0.7f}, {1.2f, 0.7f, 0.3f}, 0.03f},
                      {{0.9f, 0.1f, 0.7f}, {0.3f, 0.6f, 1.0f}, 0.03f}};
  scene.room.albedo = [](const Vector3f&) -> Vector3f { return {0.5f, 0.45f, 0.4f}; };
  return scene;
}

TEST(UnobservedOccluders, BoardBetweenTwoLamps) {
  const HalfSeenBox scene = board_between_two_lamps();
  AlbedoStage stage{capture::Session()};
  const auto result = stage.solve(scene.field(), scene.room.illumination());
  for (const float x : {-0.25f, -0.1f, 0.1f, 0.25f}) {
    const Vector3f place(x, 0.25f, 0);
    const auto [albedo, sigma] = albedo_at(*result.albedo, place);
    EXPECT_GE(sigma, 0) << x;
    EXPECT_LT((albedo - scene.room.albedo(place)).cwiseAbs().maxCoeff(), 0.08f) << x << ": " << albedo.transpose();
  }
}

// Planks differ by up to half in brightness, and not in colour: only colour tells their shadows.
TEST(UnobservedOccluders, BoardBetweenTwoLampsOnPlanks) {
  HalfSeenBox scene = board_between_two_lamps();
  scene.room.albedo = [](const Vector3f& p) -> Vector3f {
    const int plank = static_cast<int>(std::floor(p.x() / 0.07f));
    return (0.7f + 0.1f * static_cast<float>((plank * 5 % 7 + 7) % 7)) * Vector3f(0.5f, 0.45f, 0.4f);
  };
  AlbedoStage stage{capture::Session()};
  const auto result = stage.solve(scene.field(), scene.room.illumination());
  for (const float x : {-0.245f, -0.105f, 0.105f, 0.245f}) {  // in the middle of planks
    const auto [albedo, sigma] = albedo_at(*result.albedo, Vector3f(x, 0.25f, 0));
    EXPECT_GE(sigma, 0) << x;
    EXPECT_NEAR(albedo[0] / albedo[2], 0.5f / 0.4f, 0.2f) << x << ": " << albedo.transpose();
  }
}

}  // namespace
}  // namespace lumigraft::reconstruct
