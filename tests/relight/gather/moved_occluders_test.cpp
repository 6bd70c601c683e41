// What fused surface occludes while something moves.
#include "relight/gather/moved_occluders.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>

namespace lumigraft::relight {
namespace {

using Eigen::Vector3f;

/// A board that the camera at the origin sees edge-on, fused 10 mm off its true position, in front of a wall.
class BoardEdgeOn : public testing::Test {
 protected:
  BoardEdgeOn() {
    camera_.width = 101;
    camera_.height = 81;
    camera_.fx = camera_.fy = 100;
    camera_.cx = 50;
    camera_.cy = 40;
    auto board = std::make_shared<Model>();
    for (const Vector3f& corner : {Vector3f(0.01f, -0.3f, 1), Vector3f(0.01f, 0.3f, 1), Vector3f(0.01f, -0.3f, 1.4f),
                                   Vector3f(0.01f, 0.3f, 1.4f)}) {
      board->positions_m.push_back(corner);
      board->normals.push_back(-Vector3f::UnitX());
    }
    board->indices = {0, 1, 2, 2, 1, 3};
    ReferenceMesh mesh;
    mesh.model = board;
    room_ = std::make_unique<Meshes>(std::vector{mesh}, nullptr);
    depth_m_ = capture::Image<float>(camera_.width, camera_.height, 1);
    std::fill(depth_m_.data.begin(), depth_m_.data.end(), 2.0f);
  }

  void show_board() {
    for (int v = 10; v <= 70; ++v) depth_m_.at(50, v) = 1;
  }
  static GBufferPixel pixel(const Vector3f& position_m) {
    GBufferPixel result;
    result.known = true;
    result.depth_m = position_m.norm();
    result.surface.position_m = position_m;
    return result;
  }
  /// Whether the board is between a lamp and a place, after something went from around the board.
  bool occludes(const RecentlyMoved& recent = {}) const {
    const PixelRays rays(camera_);
    const MovedPixels now = {{0, pixel({-0.9f, -0.7f, 2})}, {1, pixel({0.9f, 0.7f, 2})}};
    const MovedPixels before = {{0, pixel({-0.4f, -0.4f, 0.9f})}, {1, pixel({0.4f, 0.4f, 1.5f})}};
    const MovedOccluders moved({rays, {camera_, Eigen::Isometry3f::Identity()}}, {rays, &depth_m_, 0.01f}, now, before,
                               Meshes({}, nullptr), ArrivedSurface(recent, nullptr, {}));
    return moved.blocked(*room_, {-0.4f, 0, 1.2f}, Vector3f::UnitX(), 0.8f, true);
  }

  capture::CameraModel camera_;
  std::unique_ptr<Meshes> room_;
  capture::Image<float> depth_m_;
};

TEST_F(BoardEdgeOn, OccludesWhileDepthShowsItNextToItsFusedPlace) {
  show_board();
  EXPECT_TRUE(occludes());
}

TEST_F(BoardEdgeOn, OccludesNoMoreWhereDepthShowsTheWallAllAround) { EXPECT_FALSE(occludes()); }

TEST_F(BoardEdgeOn, OccludesNoMoreWhereItMovedAMomentAgo) {
  show_board();
  RecentlyMoved recent;
  GBufferPixel wall = pixel({0.02f, 0, 2});
  recent.add(
      {{0, pixel({0.01f, 0, 1.2f})}}, {{0, wall}}, [](const GBufferPixel&) { return true; }, 0);
  EXPECT_FALSE(occludes(recent));
}

}  // namespace
}  // namespace lumigraft::relight
