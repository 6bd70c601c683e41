#include "capture/camera/camera_model.h"

#include <Eigen/Geometry>
#include <Eigen/LU>
#include <cmath>
#include <numbers>

namespace lumigraft::capture {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kPi = std::numbers::pi;

/// Whether c[0] + c[1] s + ... + c[4] s⁴ is positive on all of [0, end]. Bernstein coefficients bound the polynomial
/// (Farouki & Rajan 1987); where the bounds do not decide, de Casteljau's algorithm halves the interval.
bool positive_on(const std::array<double, 5>& c, double end) {
  constexpr double kBinomial[5][5] = {{1}, {1, 1}, {1, 2, 1}, {1, 3, 3, 1}, {1, 4, 6, 4, 1}};
  std::array<double, 5> scaled{};
  double power = 1.0;
  for (int j = 0; j < 5; ++j, power *= end) scaled[j] = c[j] * power;
  std::array<double, 5> bernstein{};
  for (int i = 0; i < 5; ++i) {
    for (int j = 0; j <= i; ++j) bernstein[i] += kBinomial[i][j] / kBinomial[4][j] * scaled[j];
  }
  const auto decide = [](const auto& self, std::array<double, 5> b, int depth) -> bool {
    if (!(b[0] > 0) || !(b[4] > 0)) return false;
    if (b[1] > 0 && b[2] > 0 && b[3] > 0) return true;
    if (depth == 0) return false;  // a double root up to rounding
    std::array<double, 5> left{};
    for (int i = 0; i < 5; ++i) {
      left[i] = b[0];
      for (int j = 0; j + i < 4; ++j) b[j] = 0.5 * (b[j] + b[j + 1]);
    }
    // b now holds the coefficients of the right half: b[4 - i] did not change after step i.
    return self(self, left, depth - 1) && self(self, b, depth - 1);
  };
  return decide(decide, bernstein, 40);  // 40 halvings: 1e-12 of the interval
}

// ---- pinhole with Brown's distortion, in normalized coordinates (x/z, y/z) ----

double radial_factor(const std::array<double, 5>& d, double s) { return 1.0 + s * (d[0] + s * (d[1] + s * d[4])); }

Vector2d distort(const std::array<double, 5>& d, const Vector2d& p, Eigen::Matrix2d* jacobian) {
  const double x = p.x(), y = p.y();
  const double s = x * x + y * y;
  const double factor = radial_factor(d, s);
  if (jacobian != nullptr) {
    const double slope = d[0] + s * (2.0 * d[1] + s * 3.0 * d[4]);  // d factor / d s
    const double cross = 2.0 * x * y * slope + 2.0 * d[2] * x + 2.0 * d[3] * y;
    *jacobian << factor + 2.0 * x * x * slope + 2.0 * d[2] * y + 6.0 * d[3] * x, cross,  //
        cross, factor + 2.0 * y * y * slope + 6.0 * d[2] * y + 2.0 * d[3] * x;
  }
  return {x * factor + 2.0 * d[2] * x * y + d[3] * (s + 2.0 * x * x),
          y * factor + d[2] * (s + 2.0 * y * y) + 2.0 * d[3] * x * y};
}

bool undistorted(const std::array<double, 5>& d) { return d == std::array<double, 5>{}; }

/// Whether p lies before the fold of the distortion: the radius grows up to p and the map keeps its orientation there.
bool before_fold(const std::array<double, 5>& d, const Vector2d& p) {
  Eigen::Matrix2d jacobian;
  distort(d, p, &jacobian);
  return positive_on({1.0, 3.0 * d[0], 5.0 * d[1], 7.0 * d[4], 0.0}, p.squaredNorm()) && jacobian.determinant() > 0;
}

/// Newton's method for distort(p) = target. Empty if it does not converge to a solution before the fold.
std::optional<Vector2d> newton(const std::array<double, 5>& d, const Vector2d& target, Vector2d p) {
  for (int i = 0; i < 30; ++i) {
    Eigen::Matrix2d jacobian;
    const Vector2d error = distort(d, p, &jacobian) - target;
    const double determinant = jacobian.determinant();
    if (!std::isfinite(determinant) || determinant == 0) return std::nullopt;
    const Vector2d step = jacobian.inverse() * error;
    p -= step;
    if (step.norm() <= 1e-15 * (1.0 + p.norm())) break;
  }
  const double residual = (distort(d, p, nullptr) - target).norm();
  const bool solved = residual <= 1e-13 * (1.0 + target.norm()) && before_fold(d, p);
  return solved ? std::optional<Vector2d>(p) : std::nullopt;
}

std::optional<Vector2d> undistort(const std::array<double, 5>& d, const Vector2d& target) {
  if (undistorted(d)) return target;
  if (auto p = newton(d, target, target)) return p;
  // Strong distortion: start from the solution of the radial part alone, found by bisection before the fold.
  const double radius = target.norm();
  const auto below = [&](double r) {
    return positive_on({1.0, 3.0 * d[0], 5.0 * d[1], 7.0 * d[4], 0.0}, r * r) && r * radial_factor(d, r * r) < radius;
  };
  double low = 0.0, high = 1.0;
  while (below(high) && high < 1e6) high *= 2.0;
  for (int i = 0; i < 60; ++i) {
    const double middle = 0.5 * (low + high);
    (below(middle) ? low : high) = middle;
  }
  return newton(d, target, radius > 0 ? Vector2d(target * (low / radius)) : target);
}

// ---- fish-eye: radius in units of the focal length as a function of the angle from the axis ----

double fisheye_radius(const CameraModel& m, double theta) {
  if (m.kind == CameraModel::Kind::equidistant) return theta;
  const double s = theta * theta;
  return theta * (1.0 + s * (m.k[0] + s * (m.k[1] + s * (m.k[2] + s * m.k[3]))));
}

std::array<double, 5> fisheye_slope(const CameraModel& m) {
  return {1.0, 3.0 * m.k[0], 5.0 * m.k[1], 7.0 * m.k[2], 9.0 * m.k[3]};  // in powers of θ²
}

bool before_fisheye_fold(const CameraModel& m, double theta) {
  return m.kind == CameraModel::Kind::equidistant || positive_on(fisheye_slope(m), theta * theta);
}

std::optional<double> fisheye_angle(const CameraModel& m, double radius) {
  if (m.kind == CameraModel::Kind::equidistant) return radius <= kPi ? std::optional<double>(radius) : std::nullopt;
  // Safeguarded Newton: [low, high] always contains the solution, if there is one before the fold.
  const std::array<double, 5> slope = fisheye_slope(m);
  double low = 0.0, high = kPi;
  double theta = std::min(radius, 0.5 * kPi);
  for (int i = 0; i < 100; ++i) {
    const double error = fisheye_radius(m, theta) - radius;
    const bool unfolded = before_fisheye_fold(m, theta);
    if (unfolded && std::abs(error) <= 1e-15 * (1.0 + radius)) break;
    (unfolded && error < 0 ? low : high) = theta;
    const double s = theta * theta;
    const double derivative = slope[0] + s * (slope[1] + s * (slope[2] + s * (slope[3] + s * slope[4])));
    const double next = theta - error / derivative;
    theta = unfolded && next > low && next < high ? next : 0.5 * (low + high);
  }
  const bool solved = std::abs(fisheye_radius(m, theta) - radius) <= 1e-12 && before_fisheye_fold(m, theta);
  return solved ? std::optional<double>(theta) : std::nullopt;
}

/// Of a fish-eye.
double half_field_rad(const CameraModel& m) { return m.fov_rad > 0 ? std::min(0.5 * m.fov_rad, kPi) : kPi; }

/// As CameraModel::unproject, but also beyond the field of view.
std::optional<Vector3d> unproject_unlimited(const CameraModel& m, const Vector2d& pixel) {
  const Vector2d p((pixel.x() - m.cx) / m.fx, (pixel.y() - m.cy) / m.fy);
  if (!p.allFinite()) return std::nullopt;
  if (m.kind == CameraModel::Kind::pinhole) {
    const std::optional<Vector2d> q = undistort(m.distortion, p);
    return q ? std::optional<Vector3d>(Vector3d(q->x(), q->y(), 1.0).normalized()) : std::nullopt;
  }
  const double radius = p.norm();
  const std::optional<double> theta = fisheye_angle(m, radius);
  if (!theta) return std::nullopt;
  const double scale = radius > 0 ? std::sin(*theta) / radius : 1.0;
  return Vector3d(p.x() * scale, p.y() * scale, std::cos(*theta)).normalized();
}

bool within_field(const CameraModel& m, const Vector3d& direction) {
  if (m.kind == CameraModel::Kind::pinhole) return true;
  constexpr double kRounding = 1e-12;
  return std::atan2(direction.head<2>().norm(), direction.z()) <= half_field_rad(m) + kRounding;
}

/// Solid angle of a spherical triangle of unit vectors (van Oosterom & Strackee 1983, eq. 8).
double triangle_sr(const Vector3d& a, const Vector3d& b, const Vector3d& c) {
  return 2.0 * std::atan2(a.dot(b.cross(c)), 1.0 + a.dot(b) + b.dot(c) + c.dot(a));
}

double quad_sr(const Vector3d& a, const Vector3d& b, const Vector3d& c, const Vector3d& d) {
  return std::abs(triangle_sr(a, b, c) + triangle_sr(a, c, d));
}

/// Solid angle of the square of `size` pixels around `centre`; 0 if a corner has no direction.
double cell_sr(const CameraModel& m, const Vector2d& centre, double size) {
  const double h = 0.5 * size;
  const auto a = unproject_unlimited(m, centre + Vector2d(-h, -h));
  const auto b = unproject_unlimited(m, centre + Vector2d(h, -h));
  const auto c = unproject_unlimited(m, centre + Vector2d(h, h));
  const auto d = unproject_unlimited(m, centre + Vector2d(-h, h));
  return a && b && c && d ? quad_sr(*a, *b, *c, *d) : 0.0;
}

}  // namespace

std::optional<Eigen::Vector2d> CameraModel::project(const Eigen::Vector3d& direction) const {
  if (!direction.allFinite()) return std::nullopt;
  if (kind == Kind::pinhole) {
    if (!(direction.z() > 0)) return std::nullopt;
    const Vector2d p(direction.x() / direction.z(), direction.y() / direction.z());
    if (undistorted(distortion)) return Vector2d(fx * p.x() + cx, fy * p.y() + cy);
    if (!p.allFinite() || !before_fold(distortion, p)) return std::nullopt;
    const Vector2d q = distort(distortion, p, nullptr);
    return Vector2d(fx * q.x() + cx, fy * q.y() + cy);
  }
  const double off_axis = direction.head<2>().norm();
  if (off_axis == 0.0) {  // on the axis; the opposite direction has no azimuth and so no pixel
    return direction.z() > 0 ? std::optional<Vector2d>(Vector2d(cx, cy)) : std::nullopt;
  }
  const double theta = std::atan2(off_axis, direction.z());
  if (theta > half_field_rad(*this) || !before_fisheye_fold(*this, theta)) return std::nullopt;
  const double radius = fisheye_radius(*this, theta);
  return Vector2d(cx + fx * radius * direction.x() / off_axis, cy + fy * radius * direction.y() / off_axis);
}

std::optional<Eigen::Vector3d> CameraModel::unproject(const Eigen::Vector2d& pixel) const {
  const std::optional<Vector3d> direction = unproject_unlimited(*this, pixel);
  return direction && within_field(*this, *direction) ? direction : std::nullopt;
}

double CameraModel::solid_angle_sr(int u, int v) const {
  const Vector2d centre(u, v);
  const auto a = unproject(centre + Vector2d(-0.5, -0.5));
  const auto b = unproject(centre + Vector2d(0.5, -0.5));
  const auto c = unproject(centre + Vector2d(0.5, 0.5));
  const auto d = unproject(centre + Vector2d(-0.5, 0.5));
  if (a && b && c && d) return quad_sr(*a, *b, *c, *d);
  if (!a && !b && !c && !d && !unproject(centre)) {
    return 0.0;  // neglects a field of view that only touches an edge of the pixel
  }
  // On the border of the field of view: sum over small cells whose centre is visible.
  constexpr int kCells = 16;
  double sum = 0.0;
  for (int i = 0; i < kCells; ++i) {
    for (int j = 0; j < kCells; ++j) {
      const Vector2d cell = centre + Vector2d((i + 0.5) / kCells - 0.5, (j + 0.5) / kCells - 0.5);
      if (unproject(cell)) sum += cell_sr(*this, cell, 1.0 / kCells);
    }
  }
  return sum;
}

}  // namespace lumigraft::capture
