#include "reconstruct/pose/print_alignment.h"

#include <Eigen/Dense>
#include <cmath>

#include "reconstruct/math/rotation_vector.h"
#include "reconstruct/pose/parameters.h"
#include "reconstruct/pose/tag_print.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

/// Pixels within `reach_m` of the tag's centre along both axes of the tag.
std::vector<PixelSample> pixels_on_tag(const std::vector<PixelSample>& seen, double reach_m,
                                       const Isometry3d& T_camera_tag) {
  const Isometry3d T_tag_camera = T_camera_tag.inverse();
  std::vector<PixelSample> pixels;
  for (const PixelSample& pixel : seen) {
    const Vector3d direction = T_tag_camera.linear() * pixel.ray.homogeneous();
    const double depth = -T_tag_camera.translation().z() / direction.z();
    const Vector3d on_tag = T_tag_camera.translation() + depth * direction;
    if (depth > 0 && std::abs(on_tag.x()) <= reach_m && std::abs(on_tag.y()) <= reach_m) pixels.push_back(pixel);
  }
  return pixels;
}

// Unknowns: rotation about the tag's centre and translation (camera frame); ink, paper, the paper's slopes; blur.
constexpr int kUnknowns = 11;
using PrintVector = Eigen::Matrix<double, kUnknowns, 1>;
using PrintMatrix = Eigen::Matrix<double, kUnknowns, kUnknowns>;

struct Fit {
  PrintMatrix jtj = PrintMatrix::Zero();
  PrintVector jtr = PrintVector::Zero();
  double error = 0;  ///< Σ ρ(r)
  int used = 0;      ///< pixels that are not clipped, or that contradict their lower bound
  int edges = 0, clipped_edges = 0;
};

class Problem {
 public:
  Problem(const std::vector<PixelSample>& pixels, const PrintIntegral& print, const TagPattern& pattern, double size_m)
      : pixels_(pixels),
        print_(print),
        cell_m_(size_m / pattern.square_cells),
        half_cells_(pattern.cells / 2.0),
        half_m_(size_m / 2) {}

  /// Normal equations with Huber's ρ of threshold `limit`, so that a finger or a highlight on the tag does not move it.
  /// `hold`: weight of a prior that keeps the blur near one pixel. It is needed where paper is clipped: there a wide
  /// blur of bright paper and a narrow blur of darker paper have the same dark side.
  Fit linearise(const Isometry3d& pose, const PrintAppearance& appearance, double limit, double hold) const {
    Fit fit;
    fit.jtj(10, 10) = hold * hold;
    fit.jtr[10] = hold * hold * (appearance.blur - 1);
    fit.error = hold * hold * (appearance.blur - 1) * (appearance.blur - 1);
    const Eigen::Matrix3d to_tag = pose.linear().transpose();
    const Vector3d normal = pose.linear().col(2), centre = pose.translation();
    const double height_m = normal.dot(centre);
    const double contrast_per_m = (appearance.paper - appearance.ink) / cell_m_;
    // A footprint is the mean of two boxes whose squared sizes are larger and smaller by the fraction `spread`.
    // Together they have the second moment of one box, and the fourth moment of a box-shaped pixel blurred by a
    // Gaussian lens, whose excess is -1.2 / b⁴ for a blur of b pixels. A single box would make the dark sides of soft
    // edges too steep.
    const double spread = std::sqrt(2.0 / 3 * (1 - std::pow(std::max(appearance.blur, 1.0), -4)));
    const double wide = std::sqrt(1 + spread), narrow = std::sqrt(1 - spread);
    for (const PixelSample& pixel : pixels_) {
      const Vector3d ray = pixel.ray.homogeneous();
      const double along = normal.dot(ray);
      const double depth = height_m / along;
      const Vector3d arm = depth * ray - centre;  // from the tag's centre to the point seen, camera frame
      const Vector3d on_tag = to_tag * arm;
      const Vector2d slant = (to_tag * ray).head<2>() / along;  // metres across the tag per metre towards it

      // The pixel's footprint as the axis-parallel box with the same second moments.
      const auto on_plane = [&](const Vector2d& by) -> Vector2d {
        return depth * (to_tag.topLeftCorner<2, 2>() * by - normal.head<2>().dot(by) * slant);
      };
      const Vector2d by_u = on_plane(pixel.ray_by_u), by_v = on_plane(pixel.ray_by_v);
      const double width = appearance.blur * std::sqrt(by_u.x() * by_u.x() + by_v.x() * by_v.x()) / cell_m_;
      const double height = appearance.blur * std::sqrt(by_u.y() * by_u.y() + by_v.y() * by_v.y()) / cell_m_;

      const auto mean = print_.mean_of_two(half_cells_ + on_tag.x() / cell_m_, half_cells_ - on_tag.y() / cell_m_,
                                           width, height, wide, narrow);
      const double white = mean.white;
      const double x = on_tag.x() / half_m_, y = on_tag.y() / half_m_;
      const double paper = appearance.paper + appearance.slope_x * x + appearance.slope_y * y;
      const double residual = appearance.ink + (paper - appearance.ink) * white - pixel.light;
      const bool edge = white > 0.01 && white < 0.99;
      fit.edges += edge;
      fit.clipped_edges += edge && pixel.clipped;
      if (pixel.clipped && residual >= 0) continue;
      ++fit.used;
      const double size = std::abs(residual);
      const double weight = size <= limit ? 1 : limit / size;
      fit.error += size <= limit ? residual * residual : limit * (2 * size - limit);

      PrintVector j;
      j.tail<5>() << 1 - white, white, white * x, white * y, 0;
      if (mean.flat) {  // no edge: the pixel does not depend on the pose
        fit.jtj.block<4, 4>(6, 6) += weight * j.segment<4>(6) * j.segment<4>(6).transpose();
        fit.jtr.segment<4>(6) += weight * residual * j.segment<4>(6);
        continue;
      }
      // Gradient per metre, y towards the tag's top. A translation s of the tag moves the observed point on the tag by
      // (n·s) slant - (s in the tag frame); a rotation ω about its centre acts as the translation ω × arm.
      const Vector2d gradient = contrast_per_m * Vector2d(mean.by_centre.x(), -mean.by_centre.y());
      const Vector3d by_shift = gradient.dot(slant) * normal - pose.linear().leftCols<2>() * gradient;
      j.head<3>() = arm.cross(by_shift);
      j.segment<3>(3) = by_shift;
      j[10] = (paper - appearance.ink) * mean.by_scale / appearance.blur;
      fit.jtj.noalias() += (weight * j) * j.transpose();
      fit.jtr += weight * residual * j;
    }
    return fit;
  }

 private:
  const std::vector<PixelSample>& pixels_;
  const PrintIntegral& print_;
  double cell_m_, half_cells_, half_m_;
};

/// The known appearance, or ink and paper from the pixels; with the level of clipping.
PrintAppearance first_appearance(const std::vector<PixelSample>& pixels, const std::optional<PrintAppearance>& known) {
  PrintAppearance result;
  if (known) {
    result = *known;
  } else {
    std::vector<double> light;
    for (const PixelSample& pixel : pixels) light.push_back(pixel.light);
    std::tie(result.ink, result.paper) = ink_and_paper(std::move(light));
  }
  double brightest_clipped = 0;
  for (const PixelSample& pixel : pixels)
    if (pixel.clipped) brightest_clipped = std::max(brightest_clipped, pixel.light);
  result.clip_level = brightest_clipped > 0 ? brightest_clipped : std::numeric_limits<double>::infinity();
  return result;
}

}  // namespace

std::optional<Alignment> align_to_print(const std::vector<PixelSample>& samples, const TagPattern& pattern,
                                        double size_m, const Isometry3d& T_camera_tag,
                                        const std::optional<PrintAppearance>& known_appearance) {
  // Some paper around the square, for its edges; not the surface around a narrow print.
  const double cell_m = size_m / pattern.square_cells;
  const double reach_m = std::min(size_m / 2 + kPrintAlignment.paper_cells * cell_m, pattern.cells * cell_m / 2);
  const std::vector<PixelSample> pixels = pixels_on_tag(samples, reach_m, T_camera_tag);
  if (pixels.size() < kPrintAlignment.min_pixels) return std::nullopt;

  PrintAppearance appearance = first_appearance(pixels, known_appearance);
  const bool clipped = std::isfinite(appearance.clip_level);
  const double contrast = appearance.contrast();
  if (!(contrast > 0)) return std::nullopt;

  const PrintIntegral print(pattern);
  const Problem problem(pixels, print, pattern, size_m);
  const double limit = kPrintAlignment.huber * contrast, hold = clipped ? kPrintAlignment.blur_hold * contrast : 0;
  Isometry3d pose = T_camera_tag;
  Fit fit = problem.linearise(pose, appearance, limit, hold);
  double damping = 1e-4;
  for (int iteration = 0; iteration < kPrintAlignment.max_iterations; ++iteration) {
    PrintMatrix damped = fit.jtj;
    damped.diagonal() *= 1 + damping;
    const PrintVector step = damped.ldlt().solve(-fit.jtr);
    if (!step.allFinite()) return std::nullopt;
    const Isometry3d next =
        isometry(rotation_by(step.head<3>()) * pose.linear(), pose.translation() + step.segment<3>(3));
    PrintAppearance next_appearance = appearance;
    next_appearance.ink += step[6];
    next_appearance.paper += step[7];
    next_appearance.slope_x += step[8];
    next_appearance.slope_y += step[9];
    next_appearance.blur = std::clamp(appearance.blur + step[10], kPrintAlignment.min_blur, kPrintAlignment.max_blur);
    const Fit next_fit = problem.linearise(next, next_appearance, limit, hold);
    const bool converged = std::abs(fit.error - next_fit.error) < kPrintAlignment.convergence * fit.error;
    if (next_fit.error < fit.error) {
      pose = next;
      appearance = next_appearance;
      fit = next_fit;
      damping /= 10;
    } else {
      damping *= 10;
    }
    if (converged) break;
  }

  Alignment result;
  if (fit.used <= 2 * kUnknowns) return std::nullopt;
  result.pixels = fit.used;
  result.clipped_fraction = fit.edges > 0 ? static_cast<double>(fit.clipped_edges) / fit.edges : 0;
  result.appearance = appearance;
  result.T_camera_tag = pose;
  result.T_camera_tag.linear() = Eigen::Quaterniond(pose.linear()).normalized().toRotationMatrix();
  const double variance = fit.error / (fit.used - kUnknowns);
  result.contrast_error = std::sqrt(variance) / appearance.contrast();
  // With a larger residual it is not this print.
  if (!(appearance.paper > appearance.ink) || result.contrast_error > kPrintAlignment.max_contrast_error)
    return std::nullopt;
  const PrintMatrix covariance = variance * fit.jtj.ldlt().solve(PrintMatrix::Identity());
  result.angle_sigma_rad = std::sqrt(covariance.topLeftCorner<3, 3>().trace());
  result.position_sigma_m = std::sqrt(covariance.block<3, 3>(3, 3).trace());
  result.covariance = camera_covariance(covariance.topLeftCorner<6, 6>(), result.T_camera_tag);
  return result;
}

}  // namespace lumigraft::reconstruct
