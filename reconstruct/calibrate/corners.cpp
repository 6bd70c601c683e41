#include "reconstruct/calibrate/corners.h"

#include <Eigen/Dense>
#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <vector>

#include "reconstruct/calibrate/parameters.h"
#include "reconstruct/calibrate/pictures.h"
#include "reconstruct/math/planar_pose.h"
#include "reconstruct/pose/gray_regions.h"
#include "reconstruct/pose/tag_print.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Matrix2d;
using Eigen::Matrix3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr auto& kFit = kCalibration.corners;
constexpr double kPrintSize = 2;  // homographies map the print in half edges

/// The plane in front of the camera that homographies map to; origin at the tag's centre, unit about one pixel.
class Chart {
 public:
  static std::optional<Chart> at(const Vector2d& centre, const capture::CameraModel* camera) {
    Chart chart;
    chart.centre_ = centre;
    chart.camera_ = camera;
    if (camera == nullptr) return chart;
    const auto direction = camera->unproject(centre);
    if (!direction) return std::nullopt;
    // The smallest rotation from the direction to the optical axis.
    const Vector3d& d = *direction;
    chart.turn_ = Eigen::Quaterniond(1 + d.z(), d.y(), -d.x(), 0).normalized().toRotationMatrix();
    const auto right = chart.from_pixel(centre + Vector2d(1, 0)), below = chart.from_pixel(centre + Vector2d(0, 1));
    if (!right || !below) return std::nullopt;
    const double area = std::abs(right->x() * below->y() - right->y() * below->x());
    if (!(area > 0)) return std::nullopt;
    chart.pixels_ = 1 / std::sqrt(area);
    return chart;
  }

  std::optional<Vector2d> from_pixel(const Vector2d& pixel) const {
    if (camera_ == nullptr) return Vector2d(pixel - centre_);
    const auto direction = camera_->unproject(pixel);
    if (!direction) return std::nullopt;
    const Vector3d turned = turn_ * *direction;
    if (turned.z() < kFit.min_cosine) return std::nullopt;
    return Vector2d(pixels_ * turned.head<2>() / turned.z());
  }
  std::optional<Vector2d> to_pixel(const Vector2d& q) const {
    if (camera_ == nullptr) return Vector2d(q + centre_);
    return camera_->project(turn_.transpose() * Vector3d(q.x(), q.y(), pixels_));
  }

 private:
  Vector2d centre_;
  const capture::CameraModel* camera_ = nullptr;
  Matrix3d turn_ = Matrix3d::Identity();
  double pixels_ = 1;
};

struct ChartPixel {
  Vector2d q, by_u, by_v;  ///< position on the chart, and its derivatives by the pixel's u and v
  double light = 0;
  bool cut = false;  ///< clipped: a lower bound
};

Matrix3d matrix_of(const Homography& h) {
  Matrix3d m;
  m << h[0], h[1], h[2], h[3], h[4], h[5], h[6], h[7], 1;
  return m;
}

/// Derivative of the position q of the print's point (x, y) by the homography.
Eigen::Matrix<double, 2, 8> by_homography(const Homography& h, double x, double y, const Vector2d& q) {
  const double w = h[6] * x + h[7] * y + 1;
  Eigen::Matrix<double, 2, 8> j;
  j << x, y, 1, 0, 0, 0, -q.x() * x, -q.x() * y,  //
      0, 0, 0, x, y, 1, -q.y() * x, -q.y() * y;
  return j / w;
}

Vector2d mapped(const Homography& h, double x, double y) {
  const double w = h[6] * x + h[7] * y + 1;
  return {(h[0] * x + h[1] * y + h[2]) / w, (h[3] * x + h[4] * y + h[5]) / w};
}

// Unknowns: the homography (8); ink, paper and the gradient of paper across the tag (4); width of the blur in pixels
// (1).
constexpr int kCornerUnknowns = 13;
using CornerVector = Eigen::Matrix<double, kCornerUnknowns, 1>;
using CornerMatrix = Eigen::Matrix<double, kCornerUnknowns, kCornerUnknowns>;

// A pixel's footprint has the second moments of a box and the fourth moments of a Gaussian, built from two boxes of
// these sizes, because lens blur is smooth. With a single box, small tags are estimated too small: by 0.04 px per
// corner at 13 px.
constexpr double kWideBox = 1.342, kNarrowBox = 0.447;  // their squares: 1 ± 0.8

struct Fit {
  CornerMatrix jtj = CornerMatrix::Zero();
  CornerVector jtr = CornerVector::Zero();
  double error = 0;     ///< Σ ρ(r), Huber's ρ
  int pixels_used = 0;  ///< unclipped, or clipped and darker in the model
  bool folded = false;
};

class Problem {
 public:
  Problem(const std::vector<ChartPixel>& pixels, const TagPattern& pattern)
      : pixels_(pixels), print_(pattern), cells_(pattern.square_cells / 2.0), middle_(pattern.cells / 2.0) {}

  /// A clipped pixel counts only where the model is darker than it (Tobin 1958): otherwise its value would move edges
  /// into the ink. `hold` is the weight of a prior that keeps the blur near one pixel.
  Fit linearise(const CornerVector& p, double limit, double hold) const {
    Fit fit;
    fit.jtj(12, 12) = hold * hold;
    fit.jtr[12] = hold * hold * (p[12] - 1);
    fit.error = hold * hold * (p[12] - 1) * (p[12] - 1);
    const Homography h = p.head<8>();
    const Matrix3d to_print = matrix_of(h).inverse();
    const double ink = p[8], contrast = p[9] - p[8], blur = p[12];
    for (const ChartPixel& pixel : pixels_) {
      const Vector3d s = to_print * pixel.q.homogeneous();
      const double x = s.x() / s.z(), y = s.y() / s.z(), w = h[6] * x + h[7] * y + 1;
      if (!(w > 0.1)) {
        fit.folded = true;
        return fit;
      }
      Matrix2d by_place;  // of q by (x, y)
      by_place << h[0] - pixel.q.x() * h[6], h[1] - pixel.q.x() * h[7], h[3] - pixel.q.y() * h[6],
          h[4] - pixel.q.y() * h[7];
      const Matrix2d to_place = (by_place / w).inverse();
      // The pixel's footprint, approximated by an axis-parallel box with the same second moments.
      const Vector2d u = to_place * pixel.by_u, v = to_place * pixel.by_v;
      const double width = blur * cells_ * std::sqrt(u.x() * u.x() + v.x() * v.x());
      const double height = blur * cells_ * std::sqrt(u.y() * u.y() + v.y() * v.y());
      const auto mean =
          print_.mean_of_two(middle_ + cells_ * x, middle_ - cells_ * y, width, height, kWideBox, kNarrowBox);
      const double white = mean.white, paper = contrast + p[10] * x + p[11] * y;
      const double residual = ink + paper * white - pixel.light;
      if (pixel.cut && residual >= 0) continue;
      ++fit.pixels_used;
      const double size = std::abs(residual), weight = size <= limit ? 1 : limit / size;
      fit.error += size <= limit ? residual * residual : limit * (2 * size - limit);

      CornerVector j;
      j.tail<5>() << 1 - white, white, white * x, white * y, 0;
      if (mean.flat) {  // uniform footprint: no information about positions
        fit.jtj.block<4, 4>(8, 8) += weight * j.segment<4>(8) * j.segment<4>(8).transpose();
        fit.jtr.segment<4>(8) += weight * residual * j.segment<4>(8);
        continue;
      }
      // The pixel is fixed, so its position on the print moves against the homography.
      const Vector2d gradient = paper * cells_ * Vector2d(mean.by_centre.x(), -mean.by_centre.y());
      j.head<8>() = -(by_homography(h, x, y, pixel.q).transpose() * (to_place.transpose() * gradient));
      j[12] = paper * mean.by_scale / blur;
      fit.jtj.noalias() += (weight * j) * j.transpose();
      fit.jtr += weight * residual * j;
    }
    return fit;
  }

 private:
  const std::vector<ChartPixel>& pixels_;
  PrintIntegral print_;
  double cells_, middle_;
};

/// Pixels up to half a cell outside the black square: includes its edges and excludes neighbouring tags.
std::vector<ChartPixel> pixels_on_print(const capture::Image<std::uint16_t>& light, const TagPattern& pattern,
                                        const TagCorners& corners, const Chart& chart, const Homography& h) {
  const PixelRegion region = region_of_print(corners, pattern, light.width, light.height);
  std::vector<std::optional<Vector2d>> chart_of;
  chart_of.reserve(static_cast<std::size_t>(region.width) * region.height);
  for (int v = region.top; v < region.top + region.height; ++v)
    for (int u = region.left; u < region.left + region.width; ++u) chart_of.push_back(chart.from_pixel({u, v}));

  const Matrix3d to_print = matrix_of(h).inverse();
  const double reach = 1 + 1.0 / pattern.square_cells;
  std::vector<ChartPixel> pixels;
  for (int y = 1; y + 1 < region.height; ++y)
    for (int x = 1; x + 1 < region.width; ++x) {
      const std::size_t i = static_cast<std::size_t>(y) * region.width + x;
      const auto stride = static_cast<std::size_t>(region.width);
      if (!chart_of[i] || !chart_of[i - 1] || !chart_of[i + 1] || !chart_of[i - stride] || !chart_of[i + stride])
        continue;
      const Vector3d s = to_print * chart_of[i]->homogeneous();
      if (!(std::abs(s.x()) <= reach * std::abs(s.z()) && std::abs(s.y()) <= reach * std::abs(s.z()))) continue;
      pixels.push_back(
          {*chart_of[i], (*chart_of[i + 1] - *chart_of[i - 1]) / 2, (*chart_of[i + stride] - *chart_of[i - stride]) / 2,
           light.at(region.left + x, region.top + y) / 65535.0, is_cut(light.at(region.left + x, region.top + y))});
    }
  return pixels;
}

/// Initial values: ink and paper from the pixels; a small blur.
std::optional<CornerVector> initial_values(const Homography& h, const std::vector<ChartPixel>& pixels) {
  std::vector<double> light;
  for (const ChartPixel& pixel : pixels) light.push_back(pixel.light);
  const auto [ink, paper] = ink_and_paper(std::move(light));
  CornerVector p;
  p << h, ink, paper, 0, 0, 1;
  return p[9] > p[8] ? std::optional(p) : std::nullopt;
}

/// Corners in pixels with their covariance, from the homography and its covariance.
std::optional<PrintCorners> corners_of(const Homography& h, const Eigen::Matrix<double, 8, 8>& covariance,
                                       const Chart& chart) {
  PrintCorners result;
  Eigen::Matrix<double, 8, 8> j;
  const auto print = tag_corners(kPrintSize);
  for (int i = 0; i < 4; ++i) {
    const double x = print[i].x(), y = print[i].y();
    const Vector2d q = mapped(h, x, y);
    constexpr double kStep = 0.5;
    const auto pixel = chart.to_pixel(q), right = chart.to_pixel(q + Vector2d(kStep, 0)),
               below = chart.to_pixel(q + Vector2d(0, kStep));
    if (!pixel || !right || !below) return std::nullopt;
    Matrix2d to_pixels;
    to_pixels << (*right - *pixel) / kStep, (*below - *pixel) / kStep;
    result.pixels[static_cast<std::size_t>(i)] = *pixel;
    j.middleRows<2>(2 * i) = to_pixels * by_homography(h, x, y, q);
  }
  result.covariance = j * covariance * j.transpose();
  return result;
}

}  // namespace

std::optional<PrintCorners> print_corners(const capture::Image<std::uint16_t>& light, const TagPattern& pattern,
                                          const TagCorners& start, const capture::CameraModel* camera) {
  for (const Vector2d& corner : start)
    if (!(corner.x() > 2 && corner.y() > 2 && corner.x() < light.width - 3 && corner.y() < light.height - 3))
      return std::nullopt;
  const auto chart = Chart::at((start[0] + start[1] + start[2] + start[3]) / 4, camera);
  if (!chart) return std::nullopt;
  std::array<Vector2d, 4> q;
  for (std::size_t i = 0; i < 4; ++i) {
    const auto on_chart = chart->from_pixel(start[i]);
    if (!on_chart) return std::nullopt;
    q[i] = *on_chart;
  }
  const auto h = square_homography(kPrintSize, q);
  if (!h) return std::nullopt;
  const std::vector<ChartPixel> pixels = pixels_on_print(light, pattern, start, *chart, *h);
  if (pixels.size() < kFit.min_print_px) return std::nullopt;
  const auto initial = initial_values(*h, pixels);
  if (!initial) return std::nullopt;

  const Problem problem(pixels, pattern);
  CornerVector p = *initial;
  const bool cut = std::any_of(pixels.begin(), pixels.end(), [](const ChartPixel& pixel) { return pixel.cut; });
  const double contrast = p[9] - p[8], limit = kFit.huber * contrast, hold = cut ? kFit.blur_hold * contrast : 0;
  Fit fit = problem.linearise(p, limit, hold);
  double damping = kFit.first_damping;
  for (int iteration = 0; iteration < kFit.iterations && !fit.folded; ++iteration) {
    CornerMatrix damped = fit.jtj;
    damped.diagonal() *= 1 + damping;
    const CornerVector step = damped.ldlt().solve(-fit.jtr);
    if (!step.allFinite()) return std::nullopt;
    CornerVector next = p + step;
    next[12] = std::clamp(next[12], kFit.min_blur_px, kFit.max_blur_px);
    const Fit next_fit = problem.linearise(next, limit, hold);
    const bool settled = std::abs(fit.error - next_fit.error) < kFit.settled * fit.error;
    if (!next_fit.folded && next_fit.error < fit.error) {
      p = next;
      fit = next_fit;
      damping /= 10;
    } else if (damping > kFit.max_damping) {
      break;
    } else {
      damping *= 10;
    }
    if (settled) break;
  }
  if (fit.pixels_used <= 2 * kCornerUnknowns) return std::nullopt;
  const double variance = fit.error / (fit.pixels_used - kCornerUnknowns);
  const CornerMatrix covariance = variance * fit.jtj.ldlt().solve(CornerMatrix::Identity());
  auto result = corners_of(p.head<8>(), covariance.topLeftCorner<8, 8>(), *chart);
  if (fit.folded || !result || !result->covariance.allFinite()) return std::nullopt;
  result->paper = p[9];
  result->contrast_error = std::sqrt(variance) / (cut ? contrast : p[9] - p[8]);
  if (!(p[9] > p[8]) || result->contrast_error > kFit.max_error) return std::nullopt;
  // A corner that moved farther than the detector's error belongs to something else.
  const double edge = (start[1] - start[0]).norm();
  for (std::size_t i = 0; i < 4; ++i)
    if ((result->pixels[i] - start[i]).norm() > std::max(kFit.far_px, kFit.far_edges * edge)) return std::nullopt;
  return result;
}

}  // namespace lumigraft::reconstruct
