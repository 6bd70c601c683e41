#include "reconstruct/pose_alignment.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

namespace lumigraft {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

/// The print as a function whose mean over any axis-parallel box is exact: its double integral is bilinear in every
/// cell.
class PrintIntegral {
 public:
  explicit PrintIntegral(const TagPattern& pattern) : pattern_(pattern) {
    // Some cells of paper beyond the print, so that boxes may reach over its edge.
    edge_ = pattern.cells + 2 * kMargin;
    sums_.assign(static_cast<std::size_t>(edge_ + 1) * (edge_ + 1), 0.0);
    for (int row = 0; row < edge_; ++row)
      for (int column = 0; column < edge_; ++column)
        at(column + 1, row + 1) = at(column, row + 1) + at(column + 1, row) - at(column, row) +
                                  (pattern.white_at(column - kMargin, row - kMargin) ? 1.0 : 0.0);
  }

  struct Mean {
    double white = 0;
    Vector2d by_centre;
    double by_scale = 0;  ///< by a common factor on width and height
  };
  /// Mean over the box. Cells; x right, y down, from the print's corner.
  Mean mean(double x, double y, double width, double height) const {
    const double x0 = x - width / 2, x1 = x + width / 2, y0 = y - height / 2, y1 = y + height / 2;
    const double area = width * height;
    const double left = column(x0, y0, y1), right = column(x1, y0, y1), top = row(y0, x0, x1), low = row(y1, x0, x1);
    Mean mean;
    mean.white = (integral(x1, y1) - integral(x0, y1) - integral(x1, y0) + integral(x0, y0)) / area;
    mean.by_centre = {(right - left) / area, (low - top) / area};
    mean.by_scale = (width * (left + right) + height * (top + low)) / (2 * area) - 2 * mean.white;
    return mean;
  }

 private:
  static constexpr int kMargin = 2;
  double& at(int x, int y) { return sums_[static_cast<std::size_t>(y) * (edge_ + 1) + x]; }
  double at(int x, int y) const { return sums_[static_cast<std::size_t>(y) * (edge_ + 1) + x]; }

  double integral(double x, double y) const {
    x = std::clamp(x + kMargin, 0.0, static_cast<double>(edge_));
    y = std::clamp(y + kMargin, 0.0, static_cast<double>(edge_));
    const int i = std::min(static_cast<int>(x), edge_ - 1), j = std::min(static_cast<int>(y), edge_ - 1);
    const double a = x - i, b = y - j;
    return (1 - b) * ((1 - a) * at(i, j) + a * at(i + 1, j)) + b * ((1 - a) * at(i, j + 1) + a * at(i + 1, j + 1));
  }
  /// ∫ print(x, y) dy from y0 to y1: the derivative of the integral by x.
  double column(double x, double y0, double y1) const {
    const int i = std::clamp(static_cast<int>(std::floor(x)), -kMargin, edge_ - kMargin - 1);
    return integral(i + 1, y1) - integral(i, y1) - integral(i + 1, y0) + integral(i, y0);
  }
  double row(double y, double x0, double x1) const {
    const int j = std::clamp(static_cast<int>(std::floor(y)), -kMargin, edge_ - kMargin - 1);
    return integral(x1, j + 1) - integral(x1, j) - integral(x0, j + 1) + integral(x0, j);
  }

  const TagPattern& pattern_;
  int edge_ = 0;
  std::vector<double> sums_;
};

struct Pixel {
  Vector3d ray;       ///< z = 1
  Vector3d ray_by_u;  ///< change of ray per pixel
  Vector3d ray_by_v;
  double light = 0;
};

/// Pixels that see the tag, or the paper close around it.
std::vector<Pixel> pixels_on_tag(const Image<float>& linear, const CameraModel& camera, double reach_m,
                                 const Isometry3d& T_camera_tag) {
  double low_u = std::numeric_limits<double>::max(), low_v = low_u, high_u = -low_u, high_v = -low_u;
  for (const double x : {-reach_m, reach_m})
    for (const double y : {-reach_m, reach_m}) {
      const auto pixel = camera.project(T_camera_tag * Vector3d(x, y, 0));
      if (!pixel) return {};
      low_u = std::min(low_u, pixel->x());
      high_u = std::max(high_u, pixel->x());
      low_v = std::min(low_v, pixel->y());
      high_v = std::max(high_v, pixel->y());
    }
  const Isometry3d T_tag_camera = T_camera_tag.inverse();
  const auto ray = [&](double u, double v) -> std::optional<Vector3d> {
    const auto direction = camera.unproject({u, v});
    if (!direction || direction->z() <= 0) return std::nullopt;
    return *direction / direction->z();
  };
  std::vector<Pixel> pixels;
  for (int v = std::max(0, static_cast<int>(low_v)); v <= std::min(linear.height - 1.0, high_v); ++v)
    for (int u = std::max(0, static_cast<int>(low_u)); u <= std::min(linear.width - 1.0, high_u); ++u) {
      const auto centre = ray(u, v), left = ray(u - 0.5, v), right = ray(u + 0.5, v), up = ray(u, v - 0.5),
                 down = ray(u, v + 0.5);
      if (!centre || !left || !right || !up || !down) continue;
      const Vector3d direction = T_tag_camera.linear() * *centre;
      const Vector3d on_tag = T_tag_camera.translation() - T_tag_camera.translation().z() / direction.z() * direction;
      if (std::abs(on_tag.x()) > reach_m || std::abs(on_tag.y()) > reach_m) continue;
      pixels.push_back({*centre, *right - *left, *down - *up, linear.at(u, v)});
    }
  return pixels;
}

// Unknowns: turn about the tag's centre and shift (camera frame); ink, paper, and paper's slope across the tag; how
// much wider than a pixel the lens blurs.
constexpr int kUnknowns = 11;
using Row = Eigen::Matrix<double, kUnknowns, 1>;
using Square = Eigen::Matrix<double, kUnknowns, kUnknowns>;

struct Look {
  double ink = 0, paper = 0, slope_x = 0, slope_y = 0;
  double blur = 1;
};

struct Fit {
  Square jtj = Square::Zero();
  Row jtr = Row::Zero();
  double error = 0;  ///< Σ ρ(r)
};

class Problem {
 public:
  Problem(const std::vector<Pixel>& pixels, const PrintIntegral& print, const TagPattern& pattern, double size_m)
      : pixels_(pixels),
        print_(print),
        cell_m_(size_m / pattern.square_cells),
        half_cells_(pattern.cells / 2.0),
        half_m_(size_m / 2) {}

  /// Huber's ρ with threshold `limit` on |residual|: a finger or a highlight on the tag must not move it.
  Fit linearise(const Isometry3d& pose, const Look& look, double limit) const {
    Fit fit;
    const Eigen::Matrix3d to_tag = pose.linear().transpose();
    const Vector3d normal = pose.linear().col(2), centre = pose.translation();
    for (const Pixel& pixel : pixels_) {
      const double along = normal.dot(pixel.ray);
      const double depth = normal.dot(centre) / along;
      const Vector3d arm = depth * pixel.ray - centre;  // from the tag's centre to the point seen, camera frame
      const Vector3d on_tag = to_tag * arm;

      // The pixel's footprint, as the axis-parallel box with the same second moments.
      const auto moved = [&](const Vector3d& by) -> Vector3d {
        return to_tag * (depth * (by - normal.dot(by) / along * pixel.ray));
      };
      const Vector3d by_u = moved(pixel.ray_by_u), by_v = moved(pixel.ray_by_v);
      const double width = look.blur * std::hypot(by_u.x(), by_v.x()) / cell_m_;
      const double height = look.blur * std::hypot(by_u.y(), by_v.y()) / cell_m_;

      const auto mean =
          print_.mean(half_cells_ + on_tag.x() / cell_m_, half_cells_ - on_tag.y() / cell_m_, width, height);
      const double white = mean.white;
      // Per metre, y to the tag's top.
      const Vector2d gradient = Vector2d(mean.by_centre.x(), -mean.by_centre.y()) / cell_m_;

      const double x = on_tag.x() / half_m_, y = on_tag.y() / half_m_;
      const double paper = look.paper + look.slope_x * x + look.slope_y * y;
      const double residual = look.ink + (paper - look.ink) * white - pixel.light;

      Row j;
      const Vector3d lever = -normal.cross(arm);  // change of normal·(centre − point) by a turn
      for (int axis = 0; axis < 3; ++axis) {
        const Vector3d turn = Vector3d::Unit(axis);
        const Vector3d by_turn = to_tag * (lever[axis] / along * pixel.ray - turn.cross(arm));
        const Vector3d by_shift = to_tag * (normal[axis] / along * pixel.ray - turn);
        j[axis] = (paper - look.ink) * gradient.dot(by_turn.head<2>());
        j[3 + axis] = (paper - look.ink) * gradient.dot(by_shift.head<2>());
      }
      j[6] = 1 - white;
      j[7] = white;
      j[8] = white * x;
      j[9] = white * y;
      j[10] = (paper - look.ink) * mean.by_scale / look.blur;

      const double size = std::abs(residual);
      const double weight = size <= limit ? 1 : limit / size;
      fit.error += size <= limit ? residual * residual : limit * (2 * size - limit);
      fit.jtj += weight * j * j.transpose();
      fit.jtr += weight * residual * j;
    }
    return fit;
  }

 private:
  const std::vector<Pixel>& pixels_;
  const PrintIntegral& print_;
  double cell_m_, half_cells_, half_m_;
};

}  // namespace

std::optional<Alignment> align_to_print(const Image<float>& linear, const CameraModel& camera,
                                        const TagPattern& pattern, double size_m, const Isometry3d& T_camera_tag) {
  // Half a cell of paper around the square: its edges count, and the table beyond a narrow print does not.
  const double cell_m = size_m / pattern.square_cells;
  const double reach_m = std::min(size_m / 2 + 0.5 * cell_m, pattern.cells * cell_m / 2);
  const std::vector<Pixel> pixels = pixels_on_tag(linear, camera, reach_m, T_camera_tag);
  if (pixels.size() < 100) return std::nullopt;

  std::vector<double> sorted;
  for (const Pixel& pixel : pixels) sorted.push_back(pixel.light);
  std::sort(sorted.begin(), sorted.end());
  Look look;
  look.ink = sorted[sorted.size() / 10];
  look.paper = sorted[sorted.size() * 9 / 10];
  const double contrast = look.paper - look.ink;
  if (!(contrast > 0)) return std::nullopt;

  const PrintIntegral print(pattern);
  const Problem problem(pixels, print, pattern, size_m);
  const double limit = 0.15 * contrast;
  Isometry3d pose = T_camera_tag;
  Fit fit = problem.linearise(pose, look, limit);
  double damping = 1e-4;
  for (int iteration = 0; iteration < 30; ++iteration) {
    Square damped = fit.jtj;
    damped.diagonal() *= 1 + damping;
    const Row step = damped.ldlt().solve(-fit.jtr);
    if (!step.allFinite()) return std::nullopt;
    Isometry3d next = pose;
    const Vector3d turn = step.head<3>();
    if (turn.norm() > 0) next.linear() = Eigen::AngleAxisd(turn.norm(), turn.normalized()) * pose.linear();
    next.translation() += step.segment<3>(3);
    Look next_look = look;
    next_look.ink += step[6];
    next_look.paper += step[7];
    next_look.slope_x += step[8];
    next_look.slope_y += step[9];
    next_look.blur = std::clamp(look.blur + step[10], 0.5, 4.0);
    const Fit next_fit = problem.linearise(next, next_look, limit);
    const bool settled = std::abs(fit.error - next_fit.error) < 1e-5 * fit.error;
    if (!(next_fit.error < fit.error)) {
      if (settled) break;
      damping *= 10;
      continue;
    }
    pose = next;
    look = next_look;
    fit = next_fit;
    damping /= 10;
    if (settled) break;
  }

  Alignment result;
  result.pixels = static_cast<int>(pixels.size());
  result.T_camera_tag = pose;
  result.T_camera_tag.linear() = Eigen::Quaterniond(pose.linear()).normalized().toRotationMatrix();
  const double variance = fit.error / static_cast<double>(pixels.size() - kUnknowns);
  result.contrast_error = std::sqrt(variance) / (look.paper - look.ink);
  // A print that explains less than most of the contrast is not this print.
  if (!(look.paper > look.ink) || result.contrast_error > 0.25) return std::nullopt;
  const Square covariance = variance * fit.jtj.ldlt().solve(Square::Identity());
  result.angle_sigma_rad = std::sqrt(covariance.topLeftCorner<3, 3>().trace());
  result.position_sigma_m = std::sqrt(covariance.block<3, 3>(3, 3).trace());
  return result;
}

}  // namespace lumigraft
