#include "tests/reconstruct/calibrate/board_views.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "capture/camera/response.h"
#include "capture/camera/srgb.h"

namespace lumigraft::test {
namespace {

void blur(capture::Image<float>& image, double sigma) {
  if (!(sigma > 0)) return;
  const int reach = static_cast<int>(std::ceil(4 * sigma));
  std::vector<float> kernel;
  float sum = 0;
  for (int i = -reach; i <= reach; ++i) {
    kernel.push_back(static_cast<float>(std::exp(-0.5 * i * i / (sigma * sigma))));
    sum += kernel.back();
  }
  for (float& k : kernel) k /= sum;
  const auto pass = [&](int dx, int dy) {
    capture::Image<float> out(image.width, image.height, 1);
    for (int y = 0; y < image.height; ++y)
      for (int x = 0; x < image.width; ++x) {
        float value = 0;
        for (int i = -reach; i <= reach; ++i)
          value += kernel[static_cast<std::size_t>(i + reach)] *
                   image.at(std::clamp(x + i * dx, 0, image.width - 1), std::clamp(y + i * dy, 0, image.height - 1));
        out.at(x, y) = value;
      }
    image = std::move(out);
  };
  pass(1, 0);
  pass(0, 1);
}

}  // namespace

Eigen::Isometry3d board_at(double distance_m, double angle_rad, double azimuth_rad, double slant_rad,
                           double slant_azimuth_rad, double roll_rad) {
  using Eigen::AngleAxisd, Eigen::Vector3d;
  const Vector3d sight(std::sin(angle_rad) * std::cos(azimuth_rad), std::sin(angle_rad) * std::sin(azimuth_rad),
                       std::cos(angle_rad));
  // The smallest rotation from the axis. Eigen's own function instantiates a decomposition that takes seconds to
  // compile.
  const auto to_sight = Eigen::Quaterniond(1 + sight.z(), -sight.y(), sight.x(), 0).normalized();
  const Vector3d axis(std::cos(slant_azimuth_rad), std::sin(slant_azimuth_rad), 0);
  Eigen::Isometry3d T = Eigen::Isometry3d::Identity();
  // Upright in front of the camera: x right, y up (the camera's -y), z towards it.
  T.linear() = (to_sight * AngleAxisd(slant_rad, axis) * AngleAxisd(M_PI, Vector3d::UnitX()) *
                AngleAxisd(roll_rad, Vector3d::UnitZ()))
                   .toRotationMatrix();
  T.translation() = distance_m * sight;
  return T;
}

RayGrid::RayGrid(const capture::CameraModel& camera) : width_(camera.width + 1) {
  for (int v = 0; v <= camera.height; ++v)
    for (int u = 0; u <= camera.width; ++u)
      rays_.push_back(camera.unproject({u - 0.5, v - 0.5}).value_or(Eigen::Vector3d::Zero()));
}

Eigen::Vector3d RayGrid::at(int u, int v, double x, double y) const {
  const auto i = static_cast<std::size_t>(v) * width_ + u;
  const Eigen::Vector3d &a = rays_[i], &b = rays_[i + 1], &c = rays_[i + width_], &d = rays_[i + width_ + 1];
  if (a.isZero() || b.isZero() || c.isZero() || d.isZero()) return Eigen::Vector3d::Zero();
  return (1 - y) * ((1 - x) * a + x * b) + y * ((1 - x) * c + x * d);
}

void sense(capture::Image<float>& light, const BoardSensor& sensor) {
  blur(light, sensor.blur_px);
  std::mt19937 random(sensor.seed);
  std::normal_distribution<double> gauss(0, 1);
  if (sensor.electrons > 0)
    for (float& value : light.data)
      value += static_cast<float>(gauss(random) *
                                  std::sqrt(value / sensor.electrons + sensor.read_noise * sensor.read_noise));
}

capture::Frame encoded(const capture::Image<float>& light) {
  capture::Frame picture;
  picture.encoded = capture::Image<std::uint8_t>(light.width, light.height, 3);
  for (std::size_t i = 0; i < picture.encoded.data.size(); ++i)
    picture.encoded.data[i] = static_cast<std::uint8_t>(std::lround(255 * capture::linear_to_srgb(light.data[i / 3])));
  return picture;
}

BoardDrawing::BoardDrawing(const reconstruct::Board& board, const capture::CameraModel& camera)
    : board_(board), camera_(camera), rays_(camera) {
  if (board.kind == reconstruct::Board::Kind::tags)
    finder_ = std::make_unique<reconstruct::TagFinder>(board.tag_list());
}

capture::Image<float> BoardDrawing::light(const Eigen::Isometry3d& T_camera_board, const BoardSensor& sensor) const {
  capture::Image<float> image(camera_.width, camera_.height, 1, 0.2f);
  const Eigen::Isometry3d T_board_camera = T_camera_board.inverse();
  const auto on_board = [&](const Eigen::Vector3d& ray) -> std::optional<Eigen::Vector2d> {
    const Eigen::Vector3d d = T_board_camera.linear() * ray;
    if (!(d.z() < 0)) return std::nullopt;
    const Eigen::Vector3d p = T_board_camera.translation() - T_board_camera.translation().z() / d.z() * d;
    return Eigen::Vector2d(p.head<2>());
  };
  const Eigen::Vector2d paper = 0.5 * board_.extent_m() + Eigen::Vector2d::Constant(0.5 * board_.size_m);
  // A sample lattice in which no two samples share a row or a column, so that axis-parallel edges are exact.
  constexpr int kSamples = 25;
  for (int v = 0; v < camera_.height; ++v)
    for (int u = 0; u < camera_.width; ++u) {
      const auto centre = on_board(rays_.at(u, v, 0.5, 0.5));
      if (!centre || (centre->cwiseAbs() - 1.2 * paper).maxCoeff() > 0) continue;
      double sum = 0;
      for (int s = 0; s < kSamples; ++s) {
        const auto p = on_board(rays_.at(u, v, (s + 0.5) / kSamples, (7 * s % kSamples + 0.5) / kSamples));
        sum += !p || (p->cwiseAbs() - paper).maxCoeff() > 0 ? 0.2 : white_at(*p) ? 0.75 : 0.04;
      }
      image.at(u, v) = static_cast<float>(sum / kSamples);
    }
  sense(image, sensor);
  return image;
}

capture::Frame BoardDrawing::picture(const Eigen::Isometry3d& T_camera_board, const BoardSensor& sensor) const {
  return encoded(light(T_camera_board, sensor));
}

bool BoardDrawing::white_at(const Eigen::Vector2d& p) const {
  const Eigen::Vector2d from_corner = p + 0.5 * board_.extent_m();  // from the lower left
  if (board_.kind == reconstruct::Board::Kind::chessboard) {
    const Eigen::Vector2d extent = board_.extent_m();
    if ((from_corner.array() < 0).any() || (from_corner.array() > extent.array()).any()) return true;
    const int column = static_cast<int>(from_corner.x() / board_.size_m);
    const int row = static_cast<int>((extent.y() - from_corner.y()) / board_.size_m);
    return (column + row) % 2 != 0;
  }
  const int column = static_cast<int>(std::floor(from_corner.x() / board_.pitch_m()));
  const int row = board_.rows - 1 - static_cast<int>(std::floor(from_corner.y() / board_.pitch_m()));
  if (column < 0 || row < 0 || column >= board_.columns || row >= board_.rows) return true;
  const int tag = row * board_.columns + column;
  const reconstruct::TagPattern& pattern = finder_->pattern(static_cast<std::size_t>(tag));
  const Eigen::Vector2d cell =
      (p - board_.place_m(tag).head<2>()) / board_.size_m * pattern.square_cells;  // from the tag's centre
  const double half = pattern.cells / 2.0;
  return pattern.white_at(static_cast<int>(std::floor(half + cell.x())), static_cast<int>(std::floor(half - cell.y())));
}

capture::Image<std::uint8_t> grey_of(const capture::Frame& picture) {
  const int width = picture.encoded.width, height = picture.encoded.height;
  return reconstruct::detector_codes(picture, {0, 0, width, height}, 1.0f);
}

reconstruct::BoardPicture board_picture(const reconstruct::BoardFinder& finder, const capture::Frame& picture) {
  reconstruct::BoardPicture kept{reconstruct::linear_light(picture, capture::Response::srgb()), {}};
  kept.view = finder.find(grey_of(picture), kept.light);
  return kept;
}

capture::CameraModel unknown_camera(const capture::CameraModel& truth) {
  capture::CameraModel camera;
  camera.kind = truth.kind;
  camera.width = truth.width;
  camera.height = truth.height;
  camera.fov_rad = truth.fov_rad;
  return camera;
}

reconstruct::Board test_board() {
  reconstruct::Board board;
  board.rows = 3;
  board.columns = 4;
  board.size_m = 0.05;
  board.spacing_m = 0.0125;
  return board;
}

capture::CameraModel distorted_pinhole() {
  capture::CameraModel camera;
  camera.width = 640;
  camera.height = 480;
  camera.fx = 531.7;
  camera.fy = 529.2;
  camera.cx = 325.3;
  camera.cy = 236.1;
  camera.distortion = {-0.21, 0.07, 0.0011, -0.0007, -0.01};
  return camera;
}

capture::CameraModel test_fisheye() {
  capture::CameraModel camera;
  camera.kind = capture::CameraModel::Kind::kannala_brandt;
  camera.width = camera.height = 512;
  camera.fx = 156.1;
  camera.fy = 155.4;
  camera.cx = 257.9;
  camera.cy = 252.3;
  camera.k = {-0.012, 0.004, -0.0016, 0.0002};
  camera.fov_rad = 190 * kTestDegree;
  return camera;
}

std::vector<Eigen::Isometry3d> pinhole_poses(int count) {
  constexpr double kGoldenAngle = 2.39996;
  std::vector<Eigen::Isometry3d> poses;
  for (int i = 0; i < count; ++i)
    poses.push_back(
        board_at(i % 2 == 0 ? 0.38 : 0.5, i < 4 ? 0.05 : 0.33, i * kGoldenAngle, 0.15 + 0.04 * i, 1.3 * i, 0.4 * i));
  return poses;
}

std::vector<Eigen::Isometry3d> fisheye_poses() {
  std::vector<Eigen::Isometry3d> poses;
  for (int i = 0; i < 22; ++i) {
    const double angle = i < 4 ? 0.2 : i < 10 ? 45 * kTestDegree : 72 * kTestDegree;
    const double azimuth = i < 4 ? i * M_PI / 2 : i < 10 ? i * M_PI / 3 : i * M_PI / 6;
    poses.push_back(board_at(i % 2 == 0 ? 0.2 : 0.26, angle, azimuth, 0.15 + 0.02 * i, 1.3 * i, 0.4 * i));
  }
  return poses;
}

reconstruct::BoardView exact_view(const reconstruct::Board& board, const capture::CameraModel& camera,
                                  const Eigen::Isometry3d& T_camera_board, double sigma_px, std::mt19937& random) {
  std::normal_distribution<double> gauss(0, 1);
  reconstruct::BoardView view;
  for (int tag = 0; tag < board.tags(); ++tag) {
    reconstruct::SeenPoints seen;
    seen.place = tag;
    for (const Eigen::Vector3d& corner : board.corners_m(tag)) {
      const auto pixel = camera.project(T_camera_board * corner);
      if (!pixel || !camera.inside(*pixel)) break;
      seen.points_m.push_back(corner);
      seen.pixels.push_back(*pixel + sigma_px * Eigen::Vector2d(gauss(random), gauss(random)));
    }
    seen.whitening = Eigen::MatrixXd::Identity(8, 8) / (sigma_px > 0 ? sigma_px : 1);
    if (seen.pixels.size() == 4) view.seen.push_back(std::move(seen));
  }
  return view;
}

std::vector<reconstruct::BoardView> exact_views(const reconstruct::Board& board, const capture::CameraModel& camera,
                                                const std::vector<Eigen::Isometry3d>& poses, double sigma_px,
                                                unsigned seed) {
  std::mt19937 random(seed);
  std::vector<reconstruct::BoardView> views;
  for (const Eigen::Isometry3d& pose : poses) views.push_back(exact_view(board, camera, pose, sigma_px, random));
  return views;
}

double farthest_apart_px(const capture::CameraModel& a, const capture::CameraModel& b, double angle_rad) {
  double farthest = 0;
  for (int i = 0; i <= 20; ++i)
    for (int k = 0; k <= 20; ++k) {
      const double theta = i * angle_rad / 20, phi = 2 * M_PI * k / 20;
      const auto d = a.kind == capture::CameraModel::Kind::pinhole
                         ? b.unproject({i * (b.width - 1) / 20.0, k * (b.height - 1) / 20.0})
                         : std::optional(Eigen::Vector3d(std::sin(theta) * std::cos(phi),
                                                         std::sin(theta) * std::sin(phi), std::cos(theta)));
      const auto p = a.project(*d), q = b.project(*d);
      if (!q || !b.inside(*q)) continue;
      farthest = std::max(farthest, p ? (*p - *q).norm() : 1e9);
    }
  return farthest;
}

}  // namespace lumigraft::test
