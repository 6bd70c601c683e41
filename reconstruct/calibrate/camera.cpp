#include "reconstruct/calibrate/camera.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "reconstruct/calibrate/acceptance.h"
#include "reconstruct/calibrate/initial_guess.h"
#include "reconstruct/calibrate/parameters.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kPi = std::numbers::pi;
constexpr auto& kCells = kCalibration.coverage;

Vector3d direction_at(double theta, double phi) {
  return {std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)};
}

double angle_of(const Eigen::Vector3d& direction) { return std::atan2(direction.head<2>().norm(), direction.z()); }

/// Half of the field of view: as given; otherwise up to the nearest border of the picture, or the outermost corner if
/// that is farther.
double half_field_rad(const capture::CameraModel& camera, double widest_rad) {
  if (camera.fov_rad > 0) return 0.5 * camera.fov_rad;
  double field = kPi;
  for (const Vector2d& side : {Vector2d(0, camera.cy), Vector2d(camera.width - 1, camera.cy), Vector2d(camera.cx, 0),
                               Vector2d(camera.cx, camera.height - 1)})
    if (const auto direction = camera.unproject(side)) field = std::min(field, angle_of(*direction));
  return std::max(field, widest_rad);
}

/// The quantile of the values at `fraction`, 0 to 1.
double quantile(std::vector<double> values, double fraction) {
  if (values.empty()) return 0;
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(fraction * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), at, values.end());
  return *at;
}

/// 1σ in pixels of the projection of a direction: the major axis of its error ellipse.
double place_sigma_px(const CameraCalibration& calibration, const Vector3d& direction) {
  const LensNumbers lens = lens_numbers(calibration.model);
  const bool pinhole = calibration.model.kind == capture::CameraModel::Kind::pinhole;
  Eigen::Matrix<double, 2, kLensNumbers> j;
  for (int i = 0; i < kLensNumbers; ++i) {
    const double step = std::max(1e-6, 1e-6 * std::abs(lens[static_cast<std::size_t>(i)]));
    LensNumbers more = lens, less = lens;
    more[static_cast<std::size_t>(i)] += step;
    less[static_cast<std::size_t>(i)] -= step;
    Vector2d a, b;
    if (!project_through(pinhole, more.data(), direction, a) || !project_through(pinhole, less.data(), direction, b))
      return 0;
    j.col(i) = (a - b) / (2 * step);
  }
  const Eigen::Matrix2d covariance = j * calibration.covariance * j.transpose();
  const double half = 0.5 * covariance.trace();
  return std::sqrt(half + std::sqrt(std::max(0.0, half * half - covariance.determinant())));
}

/// Maximum over the whole picture of a pinhole, or the whole field of a fish-eye.
double widest_sigma_px(const CameraCalibration& calibration) {
  const capture::CameraModel& model = calibration.model;
  constexpr int kSteps = kCalibration.sigma_steps;
  double widest = 0;
  for (int i = 0; i <= kSteps; ++i)
    for (int k = 0; k <= kSteps; ++k) {
      if (model.kind == capture::CameraModel::Kind::pinhole) {
        const auto d = model.unproject({i * (model.width - 1.0) / kSteps, k * (model.height - 1.0) / kSteps});
        if (d) widest = std::max(widest, place_sigma_px(calibration, *d));
      } else {
        const Vector3d d = direction_at((0.001 + 0.499 * i / kSteps) * model.fov_rad, 2 * kPi * k / kSteps);
        const auto pixel = model.project(d);
        if (pixel && model.inside(*pixel)) widest = std::max(widest, place_sigma_px(calibration, d));
      }
    }
  return widest;
}

std::size_t points_in(const std::vector<BoardView>& views) {
  std::size_t points = 0;
  for (const BoardView& view : views) points += view.seen.size();
  return points;
}

/// Takes the adjusted lens into `calibration`; `said` is the camera before calibration.
void take_over(CameraCalibration& calibration, const capture::CameraModel& said, const Adjustment& adjusted) {
  calibration.model = adjusted.rig.cameras[0];
  calibration.covariance = adjusted.covariance.block<kLensNumbers, kLensNumbers>(0, 0);
  for (int i = 0; i < kLensNumbers; ++i)
    calibration.sigma[static_cast<std::size_t>(i)] = std::sqrt(calibration.covariance(i, i));
  std::vector<double> errors;
  std::vector<Vector2d> pixels;
  calibration.corners = calibration.outliers = 0;
  for (const Residual& residual : adjusted.residuals) {
    ++calibration.corners;
    calibration.outliers += residual.outlier;
    errors.push_back(residual.error_px.norm());
    if (!residual.outlier) pixels.push_back(residual.pixel);
  }
  calibration.median_px = quantile(errors, 0.5);
  calibration.percent95_px = quantile(errors, 0.95);
  calibration.model.fov_rad = 0;
  if (calibration.model.kind != capture::CameraModel::Kind::pinhole && said.fov_rad > 0) {
    // Uses the given field of view if the polynomial is monotonic up to its edge.
    if (calibration.model.project(direction_at(0.5 * said.fov_rad, 0))) calibration.model.fov_rad = said.fov_rad;
  }
  calibration.coverage = coverage_of(calibration.model, pixels);
  if (calibration.model.kind != capture::CameraModel::Kind::pinhole && calibration.model.fov_rad == 0)
    calibration.model.fov_rad = 2 * calibration.coverage.widest_rad;  // up to the outermost corner
  calibration.widest_sigma_px = widest_sigma_px(calibration);
}

}  // namespace

double Coverage::reached() const {
  int all = 0, seen = 0;
  for (std::size_t i = 0; i < corners.size(); ++i) {
    all += wanted[i] != 0;
    seen += wanted[i] != 0 && corners[i] > 0;
  }
  return all > 0 ? static_cast<double>(seen) / all : 0;
}

std::string Coverage::missing() const {
  const std::array<const char*, 8> names = {"right", "lower right", "bottom", "lower left",
                                            "left",  "upper left",  "top",    "upper right"};
  double worst = 0;
  std::string where;
  for (int side = 0; side < 8; ++side) {
    const double axis = side * kPi / 4;
    int all = 0, empty = 0;
    for (int row = 0; row < rows; ++row)
      for (int column = 0; column < columns; ++column) {
        // Counts cells in the outer half within 45° of this side.
        const double x = rings ? std::cos((column + 0.5) * 2 * kPi / columns) : (column + 0.5) / columns * 2 - 1;
        const double y = rings ? std::sin((column + 0.5) * 2 * kPi / columns) : (row + 0.5) / rows * 2 - 1;
        const double out = rings ? (row + 0.5) / rows : std::max(std::abs(x), std::abs(y));
        if (!wants(column, row) || out < 0.5 || x * std::cos(axis) + y * std::sin(axis) < std::hypot(x, y) * 0.707)
          continue;
        ++all;
        empty += at(column, row) == 0;
      }
    if (all > 0 && empty > worst * all) {
      worst = static_cast<double>(empty) / all;
      where = names[static_cast<std::size_t>(side)];
    }
  }
  return where;
}

std::string Coverage::map() const {
  std::string text;
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      const int count = at(column, row);
      text += !wants(column, row) && count == 0 ? ' ' : count == 0 ? '.' : count < 10 ? '+' : '#';
    }
    text += '\n';
  }
  return text;
}

Coverage coverage_of(const capture::CameraModel& camera, const std::vector<Vector2d>& pixels) {
  Coverage coverage;
  coverage.rings = camera.kind != capture::CameraModel::Kind::pinhole;
  coverage.columns = coverage.rings ? kCells.sectors : kCells.columns;
  coverage.rows = kCells.rows;
  for (const Vector2d& pixel : pixels)
    if (const auto direction = camera.unproject(pixel))
      coverage.widest_rad = std::max(coverage.widest_rad, angle_of(*direction));
  if (coverage.rings) {
    coverage.field_rad = half_field_rad(camera, coverage.widest_rad);
    coverage.rows = std::max(1, static_cast<int>(std::ceil(coverage.field_rad / kCells.ring_rad - kCells.min_ring)));
  }
  const auto cells = static_cast<std::size_t>(coverage.columns) * static_cast<std::size_t>(coverage.rows);
  coverage.corners.assign(cells, 0);
  coverage.wanted.assign(cells, 1);
  // Sectors outside the picture are not required.
  for (int row = 0; coverage.rings && row < coverage.rows; ++row)
    for (int column = 0; column < coverage.columns; ++column) {
      const auto pixel = camera.project(direction_at(std::min((row + 0.5) * kCells.ring_rad, coverage.field_rad),
                                                     (column + 0.5) * 2 * kPi / kCells.sectors));
      coverage.wanted[static_cast<std::size_t>(row * coverage.columns + column)] = pixel && camera.inside(*pixel);
    }
  for (const Vector2d& pixel : pixels) {
    const auto direction = camera.unproject(pixel);
    if (!direction) continue;
    const double theta = angle_of(*direction);
    double column = (pixel.x() + 0.5) / camera.width * coverage.columns;
    double row = (pixel.y() + 0.5) / camera.height * coverage.rows;
    if (coverage.rings) {
      const double phi = std::atan2(direction->y(), direction->x());
      column = (phi < 0 ? phi + 2 * kPi : phi) / (2 * kPi) * kCells.sectors;
      row = theta / kCells.ring_rad;
    }
    const int c = std::clamp(static_cast<int>(column), 0, coverage.columns - 1);
    const int r = std::clamp(static_cast<int>(row), 0, coverage.rows - 1);
    ++coverage.corners[static_cast<std::size_t>(r * coverage.columns + c)];
  }
  return coverage;
}

CameraCalibration calibrate_camera(const capture::CameraModel& camera, const BoardFinder& finder,
                                   std::vector<BoardPicture>& pictures) {
  CameraCalibration calibration;
  calibration.model = camera;
  calibration.covariance.setZero();
  std::vector<BoardView> views;
  for (const BoardPicture& picture : pictures) {
    views.push_back(picture.view);
    calibration.views += !picture.view.seen.empty();
  }
  calibration.refusal = rejection_reason(calibration);
  if (calibration.views < kCalibration.min_views) return calibration;

  const auto start = start_camera(camera, views);
  auto adjusted = start ? adjust(*start, {views}, Freedom::all) : std::nullopt;
  // Refines the corners with the lens of the first round, then with that of the second; a third round changes nothing.
  for (int round = 0; adjusted && round < 2; ++round) {
    std::vector<BoardView> again;
    for (std::size_t i = 0; i < views.size(); ++i)
      again.push_back(finder.again(views[i], pictures[i].light, adjusted->rig.cameras[0]));
    if (2 * points_in(again) < points_in(views)) break;  // the lens estimate is wrong
    views = again;
    adjusted = adjust(adjusted->rig, {views}, Freedom::all);
  }
  if (!adjusted) return calibration;
  take_over(calibration, camera, *adjusted);
  for (std::size_t i = 0; i < views.size(); ++i) pictures[i].view = views[i];
  calibration.refusal = rejection_reason(calibration);
  return calibration;
}

}  // namespace lumigraft::reconstruct
