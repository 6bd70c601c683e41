// A receding checkerboard against 32 × 32 samples in each pixel.
#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "capture/camera/srgb.h"
#include "relight/objects/texture.h"
#include "relight/views/ray_renderer.h"
#include "tests/relight/closed_form/closed_scene.h"
#include "tests/relight/exhibit/model_shapes.h"

namespace lumigraft::test {
namespace {

constexpr int kSquares = 16, kTexelsPerSquare = 8;  // along the edge of the picture, which is repeated
constexpr float kHalfEdge_m = 0.3f, kTile_m = 0.1f;
constexpr int kAcross = 32;  // samples along a pixel

relight::TexturePicture checkers() {
  constexpr int kEdge = kSquares * kTexelsPerSquare;
  auto image = std::make_shared<capture::Image<std::uint8_t>>(kEdge, kEdge, 3);
  for (int v = 0; v < kEdge; ++v) {
    for (int u = 0; u < kEdge; ++u) {
      const bool white = (u / kTexelsPerSquare + v / kTexelsPerSquare) % 2;
      for (int c = 0; c < 3; ++c) image->at(u, v, c) = white ? 235 : 20;
    }
  }
  return image;
}

/// A board in its plane z = 0, whose picture is as it is without light.
relight::VirtualObject board() {
  const float e = kHalfEdge_m;
  const Points corners{{-e, -e, 0}, {e, -e, 0}, {e, e, 0}, {-e, -e, 0}, {e, e, 0}, {-e, e, 0}};
  std::vector<Eigen::Vector2f> texcoords;
  for (const Eigen::Vector3f& p : corners) texcoords.emplace_back(p.head<2>() / kTile_m);
  relight::Model model;
  relight::Material material{.base_color = {1, 1, 1}, .specular = 0, .gltf = true};
  material.unlit = true;
  add_part(&model, corners, material, nullptr, texcoords);
  model.parts[0].base_color_texture.picture = checkers();
  relight::VirtualObject object;
  object.name = "board";
  object.model = std::make_shared<const relight::Model>(std::move(model));
  object.white_radiance = 1;
  return object;
}

/// A board that is tilted out of the picture's plane and turned in its own. Over the frames its squares become from 4
/// to 0.4 pixels wide, as seen from in front.
class Receding {
 public:
  explicit Receding(double tilt_rad) {
    // The camera looks along +y.
    turned_ = Eigen::Quaterniond(Eigen::AngleAxisd(0.6, Eigen::Vector3d::UnitY()) *
                                 Eigen::AngleAxisd(0.5 * std::numbers::pi - tilt_rad, Eigen::Vector3d::UnitX()) *
                                 Eigen::AngleAxisd(0.3, Eigen::Vector3d::UnitZ()));
    for (double distance_m = 0.16; distance_m < 1.6; distance_m *= 1.3) frames_.push_back(frame(distance_m));
  }

  capture::Session session() const { return frames_[0].scene.session(); }

  /// RMS of displayed values over frames, and pixels that the board and its neighbours fill.
  double error(relight::Renderer& renderer, const relight::Plan& plan) const {
    double squares = 0;
    int count = 0;
    for (const Frame& frame : frames_) {
      const relight::RelitPicture picture = frame.scene.relit(renderer, plan);
      for (int v = 1; v + 1 < frame.scene.height; ++v) {
        for (int u = 1; u + 1 < frame.scene.width; ++u) {
          bool filled = true;
          for (int i = 0; i < 9; ++i) filled = filled && picture.maps->mask.at(u + i % 3 - 1, v + i / 3 - 1) == 1;
          if (!filled) continue;
          squares += std::pow(static_cast<double>(picture.srgb.at(u, v, 0)) - truth(frame, u, v), 2);
          ++count;
        }
      }
    }
    EXPECT_GT(count, 2000);
    return std::sqrt(squares / count);
  }

 private:
  struct Frame {
    ClosedScene scene;
    capture::Image<float> truth;  ///< displayed values, not rounded
  };

  static double truth(const Frame& frame, int u, int v) { return static_cast<double>(frame.truth.at(u, v)); }

  Frame frame(double distance_m) const {
    ClosedScene scene;
    scene.width = 64;
    scene.height = 48;
    scene.focal_px = 100;
    scene.eye_m = {0, -1, 0.6f};
    scene.look_at_m = {0, 0, 0.6f};
    scene.exhibit.objects = {board()};
    scene.exhibit.objects[0].position_m = {0, -1 + distance_m, 0.6};
    scene.exhibit.objects[0].rotation = turned_;
    return {scene, supersampled(scene)};
  }

  /// As if the board were infinite.
  static capture::Image<float> supersampled(const ClosedScene& scene) {
    static const relight::Texture texture(checkers(), relight::Texels::srgb, false);
    const relight::VirtualObject& object = scene.exhibit.objects[0];
    const Eigen::Matrix3d to_board = object.rotation.toRotationMatrix().transpose();
    const Eigen::Vector3d eye = to_board * (scene.eye_m.cast<double>() - object.position_m);
    const Eigen::Matrix3d turn = to_board * scene.T_tag_camera().linear();
    const capture::CameraModel model = scene.session().color.model;
    capture::Image<float> truth(scene.width, scene.height, 1);
    for (int v = 0; v < scene.height; ++v) {
      for (int u = 0; u < scene.width; ++u) {
        float sum = 0;
        for (int i = 0; i < kAcross * kAcross; ++i) {
          const double x = u + (i % kAcross + 0.5) / kAcross - 0.5, y = v + (i / kAcross + 0.5) / kAcross - 0.5;
          const Eigen::Vector3d w = turn * *model.unproject({x, y});
          const Eigen::Vector3d p = eye - eye.z() / w.z() * w;
          if (p.head<2>().norm() > 2 * static_cast<double>(kHalfEdge_m)) break;
          sum += texture.at((p.head<2>() / kTile_m).cast<float>(), 1).x();
        }
        truth.at(u, v) = 255 * capture::linear_to_srgb(sum / (kAcross * kAcross));
      }
    }
    return truth;
  }

  Eigen::Quaterniond turned_;
  std::vector<Frame> frames_;
};

constexpr double kFacing_rad = 0.2, kGrazing_rad = 1.2;

TEST(RaysTexture, ARecedingCheckerboard) {
  for (const double tilt_rad : {kFacing_rad, kGrazing_rad}) {
    const Receding board(tilt_rad);
    for (const int scale : {2, 4}) {
      relight::RayRenderer renderer(board.session());
      const double error = board.error(renderer, rays_plan(scale));
      std::printf("tilted by %.1f, at one of %d x %d pixels: %.2f pixel values\n", tilt_rad, scale, scale, error);
      EXPECT_LT(error, 1) << scale << ' ' << tilt_rad;
    }
  }
}

class ClosedTexture : public ClosedTest {};
ON_BOTH_DEVICES(ClosedTexture);

TEST_P(ClosedTexture, ARecedingCheckerboard) {
  for (const double tilt_rad : {kFacing_rad, kGrazing_rad}) {
    const Receding board(tilt_rad);
    relight::Relighter relighter(device_, board.session());
    const double error = board.error(relighter, live_plan(32));
    std::printf("tilted by %.1f: %.2f pixel values\n", tilt_rad, error);
    EXPECT_LT(error, 1) << tilt_rad;
  }
}

}  // namespace
}  // namespace lumigraft::test
