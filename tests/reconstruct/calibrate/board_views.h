#pragma once
// Pictures of a calibration board, drawn through a camera model with many samples a pixel, a lens that blurs and a
// sensor that counts electrons: the truth for calibration's tests.
#include <Eigen/Geometry>
#include <cmath>
#include <memory>
#include <random>
#include <vector>

#include "capture/camera/camera_model.h"
#include "capture/frame.h"
#include "reconstruct/calibrate/board.h"
#include "reconstruct/calibrate/camera.h"
#include "reconstruct/calibrate/linear_picture.h"
#include "reconstruct/pose/gray_regions.h"

namespace lumigraft::test {

constexpr double kTestDegree = M_PI / 180;

/// The board's centre `distance_m` from the camera at `angle_rad` from its axis and `azimuth_rad` around it; its paper
/// faces the camera, then slants by `slant_rad` about an axis `slant_azimuth_rad`, and is turned in its plane.
Eigen::Isometry3d board_at(double distance_m, double angle_rad, double azimuth_rad, double slant_rad = 0,
                           double slant_azimuth_rad = 0, double roll_rad = 0);

/// Rays of the corners between pixels, from which those inside follow to a thousandth of a pixel.
class RayGrid {
 public:
  explicit RayGrid(const capture::CameraModel& camera);
  /// x, y from 0 to 1 inside pixel (u, v); zero where the camera sees nothing.
  Eigen::Vector3d at(int u, int v, double x, double y) const;

 private:
  std::size_t width_;
  std::vector<Eigen::Vector3d> rays_;
};

struct BoardSensor {
  double blur_px = 0.5;        ///< 1σ of a Gaussian lens
  double electrons = 14000;    ///< at white; 0: no noise
  double read_noise = 0.0004;  ///< of white
  unsigned seed = 1;
};

/// What becomes of light, 1 being white: the lens blurs it, the sensor counts electrons.
void sense(capture::Image<float>& light, const BoardSensor& sensor);

capture::Picture encoded(const capture::Image<float>& light);

class BoardDrawing {
 public:
  BoardDrawing(const reconstruct::Board& board, const capture::CameraModel& camera);

  /// Linear light, 1 is white.
  capture::Image<float> light(const Eigen::Isometry3d& T_camera_board, const BoardSensor& sensor) const;

  capture::Picture picture(const Eigen::Isometry3d& T_camera_board, const BoardSensor& sensor) const;

  bool white_at(const Eigen::Vector2d& p) const;

 private:
  reconstruct::Board board_;
  capture::CameraModel camera_;
  RayGrid rays_;
  std::unique_ptr<reconstruct::TagFinder> finder_;
};

capture::Image<std::uint8_t> grey_of(const capture::Picture& picture);

/// What calibration keeps of a picture.
reconstruct::BoardPicture board_picture(const reconstruct::BoardFinder& finder, const capture::Picture& picture);

/// A camera as it comes from a shop: its kind and size, nothing else.
capture::CameraModel unknown_camera(const capture::CameraModel& truth);

reconstruct::Board test_board();

capture::CameraModel distorted_pinhole();

capture::CameraModel test_fisheye();

/// The board all over the picture, at slants, as a person shows it; the first four in the middle.
std::vector<Eigen::Isometry3d> pinhole_poses(int count);

/// Around the axis, at 45° and near the rim.
std::vector<Eigen::Isometry3d> fisheye_poses();

/// Where a camera of this lens shows the board's points, with Gaussian errors of `sigma_px`, as far as they are in the
/// picture: what a detector would find, without a picture.
reconstruct::BoardView exact_view(const reconstruct::Board& board, const capture::CameraModel& camera,
                                  const Eigen::Isometry3d& T_camera_board, double sigma_px, std::mt19937& random);

std::vector<reconstruct::BoardView> exact_views(const reconstruct::Board& board, const capture::CameraModel& camera,
                                                const std::vector<Eigen::Isometry3d>& poses, double sigma_px,
                                                unsigned seed);

/// How far apart two lenses put the same direction, at worst: over a pinhole's picture, or to `angle_rad` from the
/// axis.
double farthest_apart_px(const capture::CameraModel& a, const capture::CameraModel& b, double angle_rad);

}  // namespace lumigraft::test
