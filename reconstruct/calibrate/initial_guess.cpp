#include "reconstruct/calibrate/initial_guess.h"

#include <Eigen/Eigenvalues>
#include <Eigen/SVD>
#include <algorithm>
#include <cmath>
#include <numeric>

#include "reconstruct/calibrate/parameters.h"
#include "reconstruct/math/median.h"
#include "reconstruct/math/rotation_vector.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Isometry3d;
using Eigen::Matrix3d;
using Eigen::Vector3d;
constexpr auto& kGuess = kCalibration.initial_guess;

/// Median reprojection error in pixels of the board at this pose.
double view_error_px(const BoardView& view, const capture::CameraModel& camera, const Isometry3d& T_camera_board) {
  std::vector<double> errors;
  for (const SeenPoints& seen : view.seen)
    for (std::size_t i = 0; i < seen.pixels.size(); ++i) {
      const auto pixel = camera.project(T_camera_board * seen.points_m[i]);
      errors.push_back(pixel ? (*pixel - seen.pixels[i]).norm() : 1e6);
    }
  return median(errors);
}

/// Mean of the views' median reprojection errors with this lens; views without a pose count as max_error_px.
double fit_px(const capture::CameraModel& camera, const std::vector<BoardView>& views,
              const std::vector<std::size_t>& few) {
  double sum = 0;
  for (const std::size_t i : few) {
    const auto pose = board_pose(views[i], camera);
    sum += pose ? std::min(kGuess.max_error_px, view_error_px(views[i], camera, *pose)) : kGuess.max_error_px;
  }
  return sum / static_cast<double>(few.size());
}

std::optional<Rig> posed(const capture::CameraModel& camera, const std::vector<BoardView>& views) {
  Rig rig{{camera}, {Isometry3d::Identity()}, {}};
  for (const BoardView& view : views) {
    const auto pose = view.seen.empty() ? std::optional(Isometry3d::Identity()) : board_pose(view, camera);
    if (!pose) return std::nullopt;
    rig.T_first_board.push_back(*pose);
  }
  return rig;
}

}  // namespace

std::optional<Isometry3d> board_pose(const BoardView& view, const capture::CameraModel& camera) {
  // Board coordinates in units of its size, so that the nine unknowns are of similar magnitude.
  double size_m = 0;
  for (const SeenPoints& seen : view.seen)
    for (const Vector3d& p : seen.points_m) size_m = std::max(size_m, p.norm());
  Eigen::Matrix<double, 9, 9> ata = Eigen::Matrix<double, 9, 9>::Zero();
  std::vector<std::pair<Vector3d, Vector3d>> rays;  // direction, (x, y, 1) on the board
  for (const SeenPoints& seen : view.seen)
    for (std::size_t i = 0; i < seen.pixels.size(); ++i) {
      const auto d = camera.unproject(seen.pixels[i]);
      if (!d) continue;
      const Vector3d on_board(seen.points_m[i].x() / size_m, seen.points_m[i].y() / size_m, 1);
      rays.emplace_back(*d, on_board);
      const Vector3d across =
          (std::abs(d->z()) < 0.9 ? d->cross(Vector3d::UnitZ()) : d->cross(Vector3d::UnitX())).normalized();
      for (const Vector3d& e : {across, Vector3d(d->cross(across))}) {  // e · (M on_board) = 0
        Eigen::Matrix<double, 9, 1> row;
        row << e * on_board.x(), e * on_board.y(), e * on_board.z();
        ata += row * row.transpose();
      }
    }
  if (rays.size() < 4) return std::nullopt;
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 9, 9>> solver(ata);
  Matrix3d m = Eigen::Map<const Matrix3d>(solver.eigenvectors().col(0).data());
  double front = 0;
  for (const auto& [d, on_board] : rays) front += d.dot(m * on_board) > 0 ? 1 : -1;
  if (front < 0) m = -m;
  const double scale = 2 / (m.col(0).norm() + m.col(1).norm());
  if (!std::isfinite(scale)) return std::nullopt;
  Matrix3d r;
  r << scale * m.col(0), scale * m.col(1), scale * scale * m.col(0).cross(m.col(1));
  const Eigen::JacobiSVD<Matrix3d> svd(r, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Isometry3d T = isometry(svd.matrixU() * svd.matrixV().transpose(), scale * size_m * m.col(2));
  return T.linear().determinant() > 0 && T.matrix().allFinite() ? std::optional(T) : std::nullopt;
}

std::optional<Isometry3d> refined_pose(const BoardView& view, const capture::CameraModel& camera) {
  const auto start = board_pose(view, camera);
  const auto adjusted =
      start ? adjust({{camera}, {Isometry3d::Identity()}, {*start}}, {{view}}, Freedom::poses) : std::nullopt;
  return adjusted ? std::optional(adjusted->rig.T_first_board[0]) : std::nullopt;
}

std::optional<Rig> start_camera(const capture::CameraModel& camera, const std::vector<BoardView>& views) {
  std::vector<std::size_t> few(views.size());
  std::iota(few.begin(), few.end(), 0u);
  std::stable_sort(few.begin(), few.end(),
                   [&](std::size_t a, std::size_t b) { return views[a].points() > views[b].points(); });
  few.resize(std::min(few.size(), kGuess.max_views));
  if (few.empty()) return std::nullopt;

  const bool pinhole = camera.kind == capture::CameraModel::Kind::pinhole;
  const double side = std::max(camera.width, camera.height);
  const double shortest = (pinhole ? kGuess.min_pinhole : kGuess.min_fisheye) * side;
  const double longest = (pinhole ? kGuess.max_pinhole : kGuess.max_fisheye) * side;
  struct Guess {
    capture::CameraModel camera;
    double fit_px;
  };
  std::vector<Guess> guesses;
  for (int i = 0; i < kGuess.focal_steps; ++i) {
    LensNumbers lens{};
    lens[0] = lens[1] = shortest * std::pow(longest / shortest, i / (kGuess.focal_steps - 1.0));
    lens[2] = 0.5 * (camera.width - 1);
    lens[3] = 0.5 * (camera.height - 1);
    capture::CameraModel guess = with_lens(camera, lens);
    guess.fov_rad = 0;
    guesses.push_back({guess, fit_px(guess, views, few)});
  }
  std::stable_sort(guesses.begin(), guesses.end(), [](const Guess& a, const Guess& b) { return a.fit_px < b.fit_px; });
  for (const Guess& guess : guesses) {
    const auto start = posed(guess.camera, views);
    const auto adjusted = start ? adjust(*start, {views}, Freedom::focal_length) : std::nullopt;
    if (adjusted) return adjusted->rig;
  }
  return std::nullopt;
}

}  // namespace lumigraft::reconstruct
