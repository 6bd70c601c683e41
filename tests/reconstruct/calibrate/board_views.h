#pragma once
// Synthetic pictures of a calibration board, rendered through a camera model with many samples per pixel, lens blur and
// photon noise: ground truth for calibration tests.
#include <Eigen/Geometry>
#include <cmath>
#include <memory>
#include <random>
#include <vector>

#include "capture/camera/camera_model.h"
#include "capture/frame.h"
#include "reconstruct/calibrate/board.h"
#include "reconstruct/calibrate/camera.h"
#include "reconstruct/calibrate/pictures.h"
#include "reconstruct/pose/gray_regions.h"

namespace lumigraft::test {

constexpr double kTestDegree = M_PI / 180;

/// Pose of a board: centre at `distance_m` from the camera, at `angle_rad` from its axis and `azimuth_rad` around it;
/// the paper faces the camera, then slants by `slant_rad` about an axis `slant_azimuth_rad`, and is rotated in its
/// plane.
Eigen::Isometry3d board_at(double distance_m, double angle_rad, double azimuth_rad, double slant_rad = 0,
                           double slant_azimuth_rad = 0, double roll_rad = 0);

/// Rays of the pixels' corners; rays inside a pixel are interpolated, with an error below a thousandth of a pixel.
class RayGrid {
 public:
  explicit RayGrid(const capture::CameraModel& camera);
  /// x, y from 0 to 1 inside pixel (u, v); zero outside the field of view.
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

/// Applies lens blur and photon noise to linear light; 1 is white.
void sense(capture::Image<float>& light, const BoardSensor& sensor);

capture::Frame encoded(const capture::Image<float>& light);

class BoardDrawing {
 public:
  BoardDrawing(const reconstruct::Board& board, const capture::CameraModel& camera);

  /// Linear light, 1 is white.
  capture::Image<float> light(const Eigen::Isometry3d& T_camera_board, const BoardSensor& sensor) const;

  capture::Frame picture(const Eigen::Isometry3d& T_camera_board, const BoardSensor& sensor) const;

  bool white_at(const Eigen::Vector2d& p) const;

 private:
  reconstruct::Board board_;
  capture::CameraModel camera_;
  RayGrid rays_;
  std::unique_ptr<reconstruct::TagFinder> finder_;
};

capture::Image<std::uint8_t> grey_of(const capture::Frame& picture);

/// The calibration input for a picture.
reconstruct::BoardPicture board_picture(const reconstruct::BoardFinder& finder, const capture::Frame& picture);

/// A camera before calibration: only its kind and size.
capture::CameraModel unknown_camera(const capture::CameraModel& truth);

reconstruct::Board test_board();

capture::CameraModel distorted_pinhole();

capture::CameraModel test_fisheye();

/// Boards all over the picture, slanted, as a person shows them; the first four in the centre.
std::vector<Eigen::Isometry3d> pinhole_poses(int count);

/// Boards around the axis, at 45° and near the rim.
std::vector<Eigen::Isometry3d> fisheye_poses();

/// Exact projections of the board's points inside the picture, plus Gaussian errors of `sigma_px`: simulated detections
/// without a picture.
reconstruct::BoardView exact_view(const reconstruct::Board& board, const capture::CameraModel& camera,
                                  const Eigen::Isometry3d& T_camera_board, double sigma_px, std::mt19937& random);

std::vector<reconstruct::BoardView> exact_views(const reconstruct::Board& board, const capture::CameraModel& camera,
                                                const std::vector<Eigen::Isometry3d>& poses, double sigma_px,
                                                unsigned seed);

/// Maximum distance between the projections of a direction by two lenses: over a pinhole's picture, or up to
/// `angle_rad` from the axis.
double farthest_apart_px(const capture::CameraModel& a, const capture::CameraModel& b, double angle_rad);

}  // namespace lumigraft::test
