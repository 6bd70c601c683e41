#pragma once
// Path-traced pictures of calibration boards, lit by a panel and a sky with soft shadows, with lens blur, vignetting
// and photon noise.
#include <memory>

#include "tests/reconstruct/calibrate/board_views.h"
#include "tests/relight/reference/reference_rooms.h"

namespace lumigraft::test {

/// The cells of the print and the surrounding paper, in one plane without overlap.
struct TracedBoard {
  relight::ReferenceMesh paper, ink;

  explicit TracedBoard(const reconstruct::Board& board) {
    capture::CameraModel none;
    none.width = none.height = 1;
    none.fx = none.fy = 1;
    const BoardDrawing print(board, none);
    const double cell = board.size_m / 8;  // tags of 36h11 have eight cells along an edge of their black square
    const Eigen::Vector2d half = 0.5 * board.extent_m() + Eigen::Vector2d::Constant(0.5 * board.size_m);
    const int columns = static_cast<int>(std::lround(2 * half.x() / cell));
    const int rows = static_cast<int>(std::lround(2 * half.y() / cell));
    const auto white = [&](int column, int row) {
      return print.white_at({(column + 0.5) * cell - half.x(), (row + 0.5) * cell - half.y()});
    };
    Points on_paper, on_ink;
    for (int row = 0; row < rows; ++row)
      for (int column = 0; column < columns;) {
        int end = column + 1;
        while (end < columns && white(end, row) == white(column, row)) ++end;
        const auto at = [&](int x, int y) {
          return Eigen::Vector3d(x * cell - half.x(), y * cell - half.y(), 0).cast<float>().eval();
        };
        add_quad(white(column, row) ? &on_paper : &on_ink, at(column, row), at(end, row), at(end, row + 1),
                 at(column, row + 1));
        column = end;
      }
    paper = mesh_of(on_paper, lambert(0.8f));
    ink = mesh_of(on_ink, lambert(0.04f));
  }
};

/// Traces a camera's view of the lit board; the world's frame is that of the first camera of a rig.
class BoardTracer {
 public:
  BoardTracer(const reconstruct::Board& board, const capture::CameraModel& camera,
              const Eigen::Isometry3d& T_camera_world, const capture::Vignetting& vignetting = {})
      : board_(board),
        traced_(board),
        camera_(camera),
        T_camera_world_(T_camera_world),
        gain_(capture::vignetting_gain(vignetting, camera)) {}

  capture::Frame picture(const Eigen::Isometry3d& T_world_board, int samples, const BoardSensor& sensor) const {
    capture::Image<float> seen = light(T_world_board, samples, sensor.seed);
    sense(seen, sensor);
    return encoded(seen);
  }

  /// Linear, 1 is white; after the lens, without its blur.
  capture::Image<float> light(const Eigen::Isometry3d& T_world_board, int samples, unsigned seed) const {
    constexpr float kSky = 0.45f;
    auto scene = std::make_shared<relight::ReferenceScene>();
    scene->background.setConstant(kSky);
    relight::ReferenceLamp lamp = panel({}, 0, 0, 6.0f);  // 40 cm x 30 cm, above and to one side, facing the boards
    lamp.centre_m = {0.5f, -1.1f, -0.5f};
    lamp.normal = (Eigen::Vector3f(0, 0, 0.4f) - lamp.centre_m).normalized();
    lamp.half_u_m = 0.2f * lamp.normal.cross(Eigen::Vector3f::UnitZ()).normalized();
    lamp.half_v_m = 0.15f * lamp.normal.cross(lamp.half_u_m).normalized();
    scene->lamps = {lamp};
    scene->real = {ball(0.05f, {0.13f, -0.33f, 0.15f}, lambert(0.3f)), traced_.paper, traced_.ink};
    for (std::size_t i = 1; i < 3; ++i) scene->real[i].T_tag_model = Eigen::Affine3f(T_world_board.cast<float>());

    // Only the board's region is traced; the rest is sky.
    const reconstruct::PixelRegion region = shown_in(T_camera_world_ * T_world_board);
    relight::PosedCamera crop{camera_, T_camera_world_.inverse().cast<float>()};
    crop.model.width = region.width;
    crop.model.height = region.height;
    crop.model.cx -= region.left;
    crop.model.cy -= region.top;
    const capture::Image<float> traced =
        relight::DeltaPathTracer(scene).radiance(crop, {.per_pixel = samples, .seed = seed}, false);
    capture::Image<float> light(camera_.width, camera_.height, 1, kSky);
    for (int y = 0; y < region.height; ++y)
      for (int x = 0; x < region.width; ++x) light.at(region.left + x, region.top + y) = traced.at(x, y);
    for (std::size_t i = 0; i < gain_.data.size(); ++i) light.data[i] /= gain_.data[i];
    return light;
  }

 private:
  reconstruct::PixelRegion shown_in(const Eigen::Isometry3d& T_camera_board) const {
    const Eigen::Vector2d half = 0.5 * board_.extent_m() + Eigen::Vector2d::Constant(0.5 * board_.size_m);
    Eigen::Vector2d low(1e9, 1e9), high(-1e9, -1e9);
    for (int i = -8; i <= 8; ++i)
      for (int k = -8; k <= 8; ++k) {
        const auto pixel = camera_.project(T_camera_board * Eigen::Vector3d(i * half.x() / 8, k * half.y() / 8, 0));
        if (!pixel) continue;
        low = low.cwiseMin(*pixel);
        high = high.cwiseMax(*pixel);
      }
    const Eigen::Vector2d around(6, 6);
    return reconstruct::region_around(low - around, high + around, camera_.width, camera_.height);
  }

  reconstruct::Board board_;
  TracedBoard traced_;
  capture::CameraModel camera_;
  Eigen::Isometry3d T_camera_world_;
  capture::Image<float> gain_;
};

}  // namespace lumigraft::test
