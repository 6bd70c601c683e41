#include "reconstruct/calibrate/coverage.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "reconstruct/calibrate/parameters.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Vector2d;

constexpr double kPi = std::numbers::pi;
constexpr auto& kCells = kCalibration.coverage;

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
      const double theta = std::min((row + 0.5) * kCells.ring_rad, coverage.field_rad),
                   phi = (column + 0.5) * 2 * kPi / kCells.sectors;
      const auto pixel =
          camera.project({std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)});
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

}  // namespace lumigraft::reconstruct
