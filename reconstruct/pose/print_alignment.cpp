#include "reconstruct/pose/print_alignment.h"

#include <Eigen/Dense>
#include <cmath>

#include "reconstruct/math/rotation_vector.h"
#include "reconstruct/pose/parameters.h"
#include "reconstruct/pose/print_equations.h"
#include "reconstruct/pose/tag_print.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Isometry3d;
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

  const PrintEquations equations(pixels, pattern, size_m);
  const double limit = kPrintAlignment.huber * contrast, hold = clipped ? kPrintAlignment.blur_hold * contrast : 0;
  Isometry3d pose = T_camera_tag;
  PrintFit fit = equations.linearise(pose, appearance, limit, hold);
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
    const PrintFit next_fit = equations.linearise(next, next_appearance, limit, hold);
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
  if (fit.used <= 2 * kPrintUnknowns) return std::nullopt;
  result.pixels = fit.used;
  result.clipped_fraction = fit.edges > 0 ? static_cast<double>(fit.clipped_edges) / fit.edges : 0;
  result.appearance = appearance;
  result.T_camera_tag = pose;
  result.T_camera_tag.linear() = Eigen::Quaterniond(pose.linear()).normalized().toRotationMatrix();
  const double variance = fit.error / (fit.used - kPrintUnknowns);
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
