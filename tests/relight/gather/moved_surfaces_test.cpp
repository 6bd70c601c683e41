// Which differences between this frame's depth and the fused room are surface that moved.
#include "relight/gather/moved_surfaces.h"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <random>
#include <string>

#include "reconstruct/math/depth_noise.h"
#include "relight/gather/moved_occluders.h"

namespace lumigraft::relight {
namespace {

capture::CameraModel camera() {
  capture::CameraModel camera;
  camera.width = 41;
  camera.height = 31;
  camera.fx = camera.fy = 100;
  camera.cx = 20;
  camera.cy = 15;
  return camera;
}

/// Pixels of a fused room at 1 m, where this frame's depth shows a wall at 2 m. A voxel is a pixel wide at 1 m.
class NarrowDifference : public testing::Test {
 protected:
  NarrowDifference() : camera_(camera()) {
    depth_m_ = capture::Image<float>(camera_.width, camera_.height, 1);
    std::fill(depth_m_.data.begin(), depth_m_.data.end(), 2.0f);
  }

  /// Number of pixels that moved, if the fused room is at board_m_ in these columns.
  std::size_t found(int first, int last) const {
    const PixelRays rays(camera_);
    std::vector<GBufferPixel> seen(depth_m_.data.size());
    for (int v = 0; v < camera_.height; ++v) {
      for (int u = 0; u < camera_.width; ++u) {
        GBufferPixel& pixel = seen[static_cast<std::size_t>(v * camera_.width + u)];
        pixel.known = true;
        pixel.w = rays.at(u, v);
        pixel.depth_m = (u >= first && u <= last ? board_m_ : 2.0f) / pixel.w.z();
        pixel.surface.normal = -Eigen::Vector3f::UnitZ();
      }
    }
    auto color = std::make_shared<capture::Frame>();
    color->radiance = capture::Image<float>(camera_.width, camera_.height, 3);
    capture::FrameSet frame;
    frame.color = color;
    CameraUpload picture{capture::ColorCamera{}};
    picture.take(frame);
    return moved_surfaces({}, {}, voxel_m_, {rays, {camera_, Eigen::Isometry3f::Identity()}},
                          {rays, &depth_m_, voxel_m_}, picture, seen)
        .size();
  }

  capture::CameraModel camera_;
  capture::Image<float> depth_m_;
  float board_m_ = 1, voxel_m_ = 0.01f;  ///< of the fused room
};

TEST_F(NarrowDifference, IsARodThatLeftWhereDepthIsSmoothAllAround) {
  EXPECT_EQ(found(19, 20), static_cast<std::size_t>(2 * camera_.height));
}

TEST_F(NarrowDifference, IsADisplacedEdgeNextToAJumpOfDepth) {
  for (int v = 0; v < camera_.height; ++v) {
    for (int u = 0; u < 19; ++u) depth_m_.at(u, v) = 1;
  }
  EXPECT_EQ(found(0, 19), 0u);
}

// Depth cameras answer at edges for one surface or the other, frame by frame.
TEST_F(NarrowDifference, IsAPixelThatAnswersForItsNeighbourAcrossALowEdge) {
  board_m_ = 1.9f;
  for (int v = 0; v < camera_.height; ++v) {
    for (int u = 0; u < 20; ++u) depth_m_.at(u, v) = board_m_;
    if (v % 5 < 3) depth_m_.at(20, v) = board_m_;
  }
  EXPECT_EQ(found(0, 19), 0u);
}

TEST_F(NarrowDifference, IsADisplacedEdgeOfSeveralPixelsHighOrLow) {
  voxel_m_ = 0.04f;
  for (const float board_m : {1.0f, 1.9f}) {
    board_m_ = board_m;
    for (int v = 0; v < camera_.height; ++v) {
      for (int u = 0; u < 20; ++u) depth_m_.at(u, v) = u < 18 ? board_m_ : 2.0f;
    }
    EXPECT_EQ(found(0, 19), 0u) << board_m;
  }
}

TEST_F(NarrowDifference, IsAThinThingThatCame) {
  for (int v = 0; v < camera_.height; ++v) depth_m_.at(19, v) = depth_m_.at(20, v) = 1.7f;
  EXPECT_EQ(found(-1, -2), static_cast<std::size_t>(2 * camera_.height));
}

TEST_F(NarrowDifference, IsNoiseOfOnePixel) {
  depth_m_.at(20, 15) = 1.95f;
  EXPECT_EQ(found(-1, -2), 0u);
  depth_m_.at(21, 15) = depth_m_.at(20, 16) = depth_m_.at(21, 16) = 1.95f;
  EXPECT_EQ(found(-1, -2), 4u) << "something small and low";
}

TEST_F(NarrowDifference, IsWhatFusionContinuesBeyondTheImage) {
  voxel_m_ = 0.04f;
  const auto strip = [&](int first, float z_m) {
    for (int v = 0; v < camera_.height; ++v) depth_m_.at(first, v) = depth_m_.at(first + 1, v) = z_m;
  };
  strip(39, 1.9f);
  EXPECT_EQ(found(-1, -2), 0u);
  strip(39, 2);
  strip(20, 1.9f);
  EXPECT_EQ(found(-1, -2), static_cast<std::size_t>(2 * camera_.height)) << "the same in the middle";
}

/// A wall at 2 m, and a board at 1 m in the columns from kBoard on: whether depth shows each, and whether fusion has
/// it.
struct BoardCase {
  const char* what;
  float fused_m, depth_m;  ///< of the board's columns
  bool in_front;           ///< as the mask is to say
};
constexpr int kBoard = 15;

TEST(FrontMask, HasWhatCameOrArrivedAndNotWhatWentAtTheCamerasOwnPixels) {
  const capture::CameraModel full = camera();
  const PixelRays rays(full);
  for (const BoardCase& c : {BoardCase{"came", 2, 1, true}, {"arrived", 1, 1, true}, {"went", 1, 2, false}}) {
    for (const int scale : {1, 2}) {
      SCOPED_TRACE(std::string(c.what) + ", " + std::to_string(scale));
      capture::Image<float> depth_m(full.width, full.height, 1, 2);
      for (int v = 0; v < full.height; ++v) {
        for (int u = kBoard; u < full.width; ++u) depth_m.at(u, v) = c.depth_m;
      }
      // Squares of pixels at the board's edge count as moved.
      capture::CameraModel view = full;
      view.width = (full.width + scale - 1) / scale;
      view.height = (full.height + scale - 1) / scale;
      const int first = kBoard / scale;
      std::vector<GBufferPixel> now;
      MovedPixels covered;
      for (int i = 0; i < view.width * view.height; ++i) {
        const float along = rays.at(std::min(i % view.width * scale, full.width - 1), i / view.width * scale).z();
        GBufferPixel& pixel = now.emplace_back();
        pixel.known = true;
        pixel.depth_m = 2 / along;
        if (i % view.width < first) continue;
        GBufferPixel fused = pixel;
        fused.depth_m = c.fused_m / along;
        pixel.depth_m = c.depth_m / along;
        covered.emplace_back(i, fused);
      }
      const capture::Image<std::uint8_t> front =
          front_mask(covered, {now, view, scale}, {rays, &depth_m, 0.01f}, full.width, full.height);
      for (int v = 0; v < full.height; ++v) {
        for (int u = 0; u < full.width; ++u)
          ASSERT_EQ(front.at(u, v) != 0, c.in_front && u >= kBoard) << u << ", " << v;
      }
    }
  }
}

/// A wall at 2 m, and a board at 1 m in front of its middle that fusion holds, too.
class ArrivedBoard : public testing::Test {
 protected:
  static constexpr int kFirst = 15, kLast = 25;  ///< its columns

  ArrivedBoard() : camera_(camera()) {
    depth_m_ = capture::Image<float>(camera_.width, camera_.height, 1);
    for (int v = 0; v < camera_.height; ++v) {
      for (int u = 0; u < camera_.width; ++u) depth_m_.at(u, v) = is_board(u) ? 1 : 2;
    }
  }
  static bool is_board(int u) { return u >= kFirst && u <= kLast; }

  GBufferPixel pixel(int u, int v, float z_m) const {
    GBufferPixel p;
    p.known = true;
    p.w = rays_.at(u, v);
    p.depth_m = z_m / p.w.z();
    p.surface.position_m = p.depth_m * p.w;
    p.surface.normal = -Eigen::Vector3f::UnitZ();
    return p;
  }
  /// Planes at 1 m and 2.04 m. `updates`: how often the one at 1 m was measured.
  static std::shared_ptr<const reconstruct::DistanceField> fused(float updates) {
    auto field = std::make_shared<reconstruct::DistanceField>();
    field->voxel_m = 0.01f;
    const float sigma_m = capture::DepthNoise{}.axial_sigma_m(1.0f),
                weight = static_cast<float>(std::pow(reconstruct::kMinDepthSigma_m / sigma_m, 2));
    for (int a = -6; a < 6; ++a) {
      for (int b = -6; b < 6; ++b) {
        for (const int plane : {100, 204}) {
          auto brick = std::make_shared<reconstruct::FieldBrick>();
          const int c = plane / 8;  // both are within a brick
          for (int i = 0; i < reconstruct::kBrickVoxels; ++i) {
            const auto at = static_cast<std::size_t>(i);
            brick->distance_m[at] = field->voxel_m * static_cast<float>(plane - 8 * c - i / 64);
            brick->weight[at] = (plane == 100 ? updates : 64) * weight;
          }
          field->bricks[{a, b, c}] = brick;
        }
      }
    }
    return field;
  }
  /// What moved in front of `behind` a moment ago.
  static RecentlyMoved moved_before(const MovedPixels& board, const MovedPixels& behind,
                                    const reconstruct::DistanceField& field) {
    RecentlyMoved recent;
    const auto settled = [&](const GBufferPixel& p) {
      return ArrivedSurface::is_settled(field, {}, p.surface.position_m, p.depth_m);
    };
    recent.add(board, behind, settled, 0);
    return recent;
  }
  MovedPixels board_of(float z_m) const {
    MovedPixels found;
    for (int v = 0; v < camera_.height; ++v) {
      for (int u = kFirst; u <= kLast; ++u)
        found.emplace_back(static_cast<std::size_t>(v * camera_.width + u), pixel(u, v, z_m));
    }
    return found;
  }
  /// Of the fused room that has both.
  MovedPixels found(const ArrivedSurface& arrived) const {
    std::vector<GBufferPixel> seen;
    for (int v = 0; v < camera_.height; ++v) {
      for (int u = 0; u < camera_.width; ++u) seen.push_back(pixel(u, v, is_board(u) ? 1.0f : 2.0f));
    }
    auto color = std::make_shared<capture::Frame>();
    color->radiance = capture::Image<float>(camera_.width, camera_.height, 3);
    capture::FrameSet frame;
    frame.color = color;
    CameraUpload picture{capture::ColorCamera{}};
    picture.take(frame);
    return moved_surfaces({}, {}, 0.01f, eye(), {rays_, &depth_m_, 0.01f}, picture, seen, &arrived);
  }
  CameraRays eye() const { return {rays_, {camera_, Eigen::Isometry3f::Identity()}}; }

  static constexpr std::size_t kBoard = std::size_t{kLast + 1 - kFirst} * 31;
  capture::CameraModel camera_;
  capture::Image<float> depth_m_;
  PixelRays rays_{camera()};
};

TEST_F(ArrivedBoard, IsMovedAsAWholeUntilFusionHoldsItInFull) {
  for (const float updates : {2.0f, 8.0f, 10.0f}) {
    const auto field = fused(updates);
    const ArrivedSurface arrived(moved_before(board_of(1), board_of(2.04f), *field), field, {});
    EXPECT_EQ(found(arrived).size(), updates < 9 ? kBoard : 0) << updates;
  }
}

TEST_F(ArrivedBoard, IsMovedAsAWholeForMethodsThatHaveTheFieldAlone) {
  const auto all = [](const Eigen::Vector3f&) { return true; };
  const Meshes none({}, nullptr);
  const CurrentDepth depth(rays_, &depth_m_, 0.01f);
  for (const float updates : {2.0f, 8.0f, 10.0f}) {
    const auto field = fused(updates);
    const ArrivedSurface arrived(moved_before(board_of(1), board_of(2.04f), *field), field, {});
    const MovedInField found =
        moved_in_field(eye(), depth, *field, arrived, all, [&]() -> const Meshes& { return none; });
    std::size_t of_board = 0;  // the wall at 2 m is not where the field has it
    for (const auto& [i, p] : found.now) of_board += p.surface.position_m.z() < 1.5f;
    EXPECT_EQ(of_board, updates < 9 ? kBoard : 0) << updates;
    EXPECT_EQ(moved_in_field(eye(), depth, *field, ArrivedSurface({}, field, {}), all,
                             [&]() -> const Meshes& { return none; })
                  .now.size(),
              found.now.size() - of_board);
  }
}

TEST_F(ArrivedBoard, IsOfTheRoomWhereNothingMoved) {
  const auto field = fused(2);
  EXPECT_TRUE(found(ArrivedSurface({}, field, {})).empty());
}

TEST_F(ArrivedBoard, IsOfTheRoomWhereThatIsNotSettledEither) {
  const auto field = fused(2);
  const ArrivedSurface arrived(moved_before(board_of(0.9f), board_of(1), *field), field, {});
  EXPECT_TRUE(found(arrived).empty());
}

TEST_F(ArrivedBoard, IsOfTheRoomWhereWhatIsBehindWasNotFused) {
  const auto field = fused(2);
  EXPECT_TRUE(found(ArrivedSurface(moved_before(board_of(1), board_of(3), *field), field, {})).empty());
}

TEST_F(ArrivedBoard, IsMovedWhereItsDepthIsUnknown) {
  const auto field = fused(2);
  for (int v = 10; v < 20; ++v) depth_m_.at(18, v) = 0;
  const ArrivedSurface arrived(moved_before(board_of(1), board_of(2.04f), *field), field, {});
  const MovedPixels moved = found(arrived);
  ASSERT_EQ(moved.size(), kBoard);
  for (const auto& [i, p] : moved) EXPECT_NEAR(p.surface.position_m.z(), 1, 1e-5) << i;
}

TEST_F(ArrivedBoard, HidesLampsAsThisFrameShowsItAndNotAsItWasFused) {
  const auto field = fused(2);
  const ArrivedSurface arrived(moved_before(board_of(1), board_of(2.04f), *field), field, {});
  auto wrong = std::make_shared<Model>();  // its fused surface, 1 mm in front of the point
  for (const Eigen::Vector3f& corner : {Eigen::Vector3f(-0.04f, -0.2f, 1), Eigen::Vector3f(0.04f, -0.2f, 1),
                                        Eigen::Vector3f(-0.04f, 0.2f, 1), Eigen::Vector3f(0.04f, 0.2f, 1)}) {
    wrong->positions_m.push_back(corner);
    wrong->normals.push_back(-Eigen::Vector3f::UnitZ());
  }
  wrong->indices = {0, 1, 2, 2, 1, 3};
  ReferenceMesh mesh;
  mesh.model = wrong;
  const Meshes room(std::vector{mesh}, nullptr), none({}, nullptr);
  const MovedPixels moved = found(arrived);
  const auto blocked = [&](const ArrivedSurface& of) {
    const MovedOccluders occluders(eye(), {rays_, &depth_m_, 0.01f}, moved, board_of(1), none, of);
    return occluders.blocked(room, {0, 0, 1.001f}, -Eigen::Vector3f::UnitZ(), 0.5f, true);
  };
  EXPECT_TRUE(blocked(ArrivedSurface({}, field, {})));
  EXPECT_FALSE(blocked(arrived));
}

/// A plane that rises to the right, with noise of depth.
TEST(MovedNormal, IsThatOfThePlaneNearestToNoisyDepth) {
  capture::CameraModel camera;
  camera.width = 61;
  camera.height = 41;
  camera.fx = camera.fy = 300;
  camera.cx = 30;
  camera.cy = 20;
  const PixelRays rays(camera);
  const Eigen::Vector3f normal = Eigen::Vector3f(0.4f, 0.2f, -1).normalized();
  constexpr float kSigma_m = 0.002f;
  std::mt19937 random(1);
  std::normal_distribution<float> noise(0, kSigma_m);
  capture::Image<float> depth_m(camera.width, camera.height, 1);
  std::vector<GBufferPixel> seen(depth_m.data.size());
  for (int v = 0; v < camera.height; ++v) {
    for (int u = 0; u < camera.width; ++u) {
      const Eigen::Vector3f w = rays.at(u, v);
      depth_m.at(u, v) = normal.z() * w.z() / normal.dot(w) + noise(random);  // the plane is at 1 m in the middle
      seen[static_cast<std::size_t>(v * camera.width + u)].w = w;
    }
  }
  auto color = std::make_shared<capture::Frame>();
  color->radiance = capture::Image<float>(camera.width, camera.height, 3);
  capture::FrameSet frame;
  frame.color = color;
  CameraUpload picture{capture::ColorCamera{}};
  picture.take(frame);
  const MovedPixels moved = moved_surfaces({}, {}, 0.01f, {rays, {camera, Eigen::Isometry3f::Identity()}},
                                           {rays, &depth_m, 0.01f}, picture, seen);
  double squares = 0;
  int count = 0;
  for (const auto& [i, p] : moved) {
    const auto u = static_cast<int>(i) % camera.width, v = static_cast<int>(i) / camera.width;
    if (u < 3 || v < 3 || u >= camera.width - 3 || v >= camera.height - 3) continue;
    squares += (p.surface.normal - normal).squaredNorm();
    ++count;
  }
  ASSERT_GT(count, 1500);
  // A slope over n = 7 x 7 pixels of 1/300 m at 1 m has 1 sigma of 2 mm / (3.3 mm sqrt(49 * 4)): 0.043. There are two.
  EXPECT_LT(std::sqrt(squares / count), 1.3 * std::sqrt(2.0) * 300 * kSigma_m / std::sqrt(49.0 * 4));
}

}  // namespace
}  // namespace lumigraft::relight
