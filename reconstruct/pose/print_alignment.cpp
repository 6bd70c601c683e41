#include "reconstruct/pose/print_alignment.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <vector>

#include "reconstruct/pose/tag_print.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

/// Pixels that see the tag, or the paper close around it.
std::vector<SeenPixel> pixels_on_tag(const std::vector<SeenPixel>& seen, double reach_m,
                                     const Isometry3d& T_camera_tag) {
  const Isometry3d T_tag_camera = T_camera_tag.inverse();
  std::vector<SeenPixel> pixels;
  for (const SeenPixel& pixel : seen) {
    const Vector3d direction = T_tag_camera.linear() * pixel.ray.homogeneous();
    const double depth = -T_tag_camera.translation().z() / direction.z();
    const Vector3d on_tag = T_tag_camera.translation() + depth * direction;
    if (depth > 0 && std::abs(on_tag.x()) <= reach_m && std::abs(on_tag.y()) <= reach_m) pixels.push_back(pixel);
  }
  return pixels;
}

// Unknowns: turn about the tag's centre and shift (camera frame); ink, paper, and paper's slope across the tag; how
// much wider than a pixel the lens blurs.
constexpr int kUnknowns = 11;
using Row = Eigen::Matrix<double, kUnknowns, 1>;
using Square = Eigen::Matrix<double, kUnknowns, kUnknowns>;

// Weight of blur - 1, per contrast: what one pixel says that errs by 2 % of the contrast, if 1σ of blur were 0.5.
constexpr double kBlurHold = 0.04;

struct Fit {
  Square jtj = Square::Zero();
  Row jtr = Row::Zero();
  double error = 0;  ///< Σ ρ(r)
  int told = 0;      ///< pixels that were not cut off, or contradict that they were
  int edges = 0, edges_cut = 0;
};

class Problem {
 public:
  Problem(const std::vector<SeenPixel>& pixels, const PrintIntegral& print, const TagPattern& pattern, double size_m)
      : pixels_(pixels),
        print_(print),
        cell_m_(size_m / pattern.square_cells),
        half_cells_(pattern.cells / 2.0),
        half_m_(size_m / 2) {}

  /// Huber's ρ with threshold `limit` on |residual|: a finger or a highlight on the tag must not move it. Where paper
  /// is cut off, a wide blur of bright paper has the same dark side as a narrow one of darker paper: there, and only
  /// there, it matters that the blur is held near a pixel's width by `hold`.
  Fit linearise(const Isometry3d& pose, const PrintAppearance& look, double limit, double hold) const {
    Fit fit;
    fit.jtj(10, 10) = hold * hold;
    fit.jtr[10] = hold * hold * (look.blur - 1);
    fit.error = hold * hold * (look.blur - 1) * (look.blur - 1);
    const Eigen::Matrix3d to_tag = pose.linear().transpose();
    const Vector3d normal = pose.linear().col(2), centre = pose.translation();
    const double height_m = normal.dot(centre);
    const double contrast_per_m = (look.paper - look.ink) / cell_m_;
    const double spread = std::sqrt(2.0 / 3 * (1 - std::pow(std::max(look.blur, 1.0), -4)));
    for (const SeenPixel& pixel : pixels_) {
      const Vector3d ray = pixel.ray.homogeneous();
      const double along = normal.dot(ray);
      const double depth = height_m / along;
      const Vector3d arm = depth * ray - centre;  // from the tag's centre to the point seen, camera frame
      const Vector3d on_tag = to_tag * arm;
      const Vector2d slant = (to_tag * ray).head<2>() / along;  // metres across the tag per metre towards it

      // The pixel's footprint, as the axis-parallel box with the same second moments.
      const auto moved = [&](const Vector2d& by) -> Vector2d {
        return depth * (to_tag.topLeftCorner<2, 2>() * by - normal.head<2>().dot(by) * slant);
      };
      const Vector2d by_u = moved(pixel.ray_by_u), by_v = moved(pixel.ray_by_v);
      const double width = look.blur * std::sqrt(by_u.x() * by_u.x() + by_v.x() * by_v.x()) / cell_m_;
      const double height = look.blur * std::sqrt(by_u.y() * by_u.y() + by_v.y() * by_v.y()) / cell_m_;

      const auto mean =
          blurred(half_cells_ + on_tag.x() / cell_m_, half_cells_ - on_tag.y() / cell_m_, width, height, spread);
      const double white = mean.white;
      const double x = on_tag.x() / half_m_, y = on_tag.y() / half_m_;
      const double paper = look.paper + look.slope_x * x + look.slope_y * y;
      const double residual = look.ink + (paper - look.ink) * white - pixel.light;
      const bool edge = white > 0.01 && white < 0.99;
      fit.edges += edge;
      fit.edges_cut += edge && pixel.cut;
      if (pixel.cut && residual >= 0) continue;
      ++fit.told;
      const double size = std::abs(residual);
      const double weight = size <= limit ? 1 : limit / size;
      fit.error += size <= limit ? residual * residual : limit * (2 * size - limit);

      Row j;
      j.tail<5>() << 1 - white, white, white * x, white * y, 0;
      if (mean.flat) {  // no edge in sight: the pixel says nothing about the pose
        fit.jtj.block<4, 4>(6, 6) += weight * j.segment<4>(6) * j.segment<4>(6).transpose();
        fit.jtr.segment<4>(6) += weight * residual * j.segment<4>(6);
        continue;
      }
      // Per metre, y to the tag's top. A shift s of the tag moves the point seen by (n·s) slant - (s in the tag's
      // frame) across the tag; a turn ω about its centre is the shift ω × arm.
      const Vector2d gradient = contrast_per_m * Vector2d(mean.by_centre.x(), -mean.by_centre.y());
      const Vector3d by_shift = gradient.dot(slant) * normal - pose.linear().leftCols<2>() * gradient;
      j.head<3>() = arm.cross(by_shift);
      j.segment<3>(3) = by_shift;
      j[10] = (paper - look.ink) * mean.by_scale / look.blur;
      fit.jtj.noalias() += (weight * j) * j.transpose();
      fit.jtr += weight * residual * j;
    }
    return fit;
  }

 private:
  /// Mean over two boxes whose squares are `spread` more and less than that of width and height: their second moments
  /// together are its own, and their fourth those of a pixel that is even and a lens that blurs as a Gaussian, which a
  /// blur of b pixels leaves 1.2 / b⁴ below a Gaussian's. By one box alone the dark sides of soft edges seem steeper.
  PrintIntegral::Mean blurred(double x, double y, double width, double height, double spread) const {
    const double wide = std::sqrt(1 + spread), narrow = std::sqrt(1 - spread);
    const auto a = print_.mean(x, y, wide * width, wide * height);
    if (a.flat || !(spread > 0)) return a;
    const auto b = print_.mean(x, y, narrow * width, narrow * height);
    return {(a.white + b.white) / 2, false, (a.by_centre + b.by_centre) / 2, (a.by_scale + b.by_scale) / 2};
  }

  const std::vector<SeenPixel>& pixels_;
  const PrintIntegral& print_;
  double cell_m_, half_cells_, half_m_;
};

}  // namespace

std::optional<Alignment> align_to_print(const std::vector<SeenPixel>& seen, const TagPattern& pattern, double size_m,
                                        const Isometry3d& T_camera_tag,
                                        const std::optional<PrintAppearance>& first_look) {
  // Half a cell of paper around the square: its edges count, and the table beyond a narrow print does not.
  const double cell_m = size_m / pattern.square_cells;
  const double reach_m = std::min(size_m / 2 + 0.5 * cell_m, pattern.cells * cell_m / 2);
  const std::vector<SeenPixel> pixels = pixels_on_tag(seen, reach_m, T_camera_tag);
  if (pixels.size() < 100) return std::nullopt;

  PrintAppearance look;
  if (first_look) {
    look = *first_look;
  } else {
    std::vector<double> light;
    for (const SeenPixel& pixel : pixels) light.push_back(pixel.light);
    const auto tenth = static_cast<std::ptrdiff_t>(light.size() / 10);
    std::nth_element(light.begin(), light.begin() + tenth, light.end());
    look.ink = light[static_cast<std::size_t>(tenth)];
    std::nth_element(light.begin(), light.end() - tenth, light.end());
    look.paper = *(light.end() - tenth);
  }
  look.end = std::numeric_limits<double>::infinity();
  double brightest_cut = 0;
  for (const SeenPixel& pixel : pixels)
    if (pixel.cut) brightest_cut = std::max(brightest_cut, pixel.light);
  if (brightest_cut > 0) look.end = brightest_cut;
  const double contrast = look.contrast();
  if (!(contrast > 0)) return std::nullopt;

  const PrintIntegral print(pattern);
  const Problem problem(pixels, print, pattern, size_m);
  const double limit = 0.15 * contrast, hold = brightest_cut > 0 ? kBlurHold * contrast : 0;
  Isometry3d pose = T_camera_tag;
  Fit fit = problem.linearise(pose, look, limit, hold);
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
    PrintAppearance next_look = look;
    next_look.ink += step[6];
    next_look.paper += step[7];
    next_look.slope_x += step[8];
    next_look.slope_y += step[9];
    next_look.blur = std::clamp(look.blur + step[10], 0.5, 4.0);
    const Fit next_fit = problem.linearise(next, next_look, limit, hold);
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
  if (fit.told <= 2 * kUnknowns) return std::nullopt;
  result.pixels = fit.told;
  result.cut_share = fit.edges > 0 ? static_cast<double>(fit.edges_cut) / fit.edges : 0;
  result.look = look;
  result.T_camera_tag = pose;
  result.T_camera_tag.linear() = Eigen::Quaterniond(pose.linear()).normalized().toRotationMatrix();
  const double variance = fit.error / (fit.told - kUnknowns);
  result.contrast_error = std::sqrt(variance) / look.contrast();
  // A print that explains less than most of the contrast is not this print.
  if (!(look.paper > look.ink) || result.contrast_error > 0.25) return std::nullopt;
  const Square covariance = variance * fit.jtj.ldlt().solve(Square::Identity());
  result.angle_sigma_rad = std::sqrt(covariance.topLeftCorner<3, 3>().trace());
  result.position_sigma_m = std::sqrt(covariance.block<3, 3>(3, 3).trace());
  result.covariance = camera_covariance(covariance.topLeftCorner<6, 6>(), result.T_camera_tag);
  return result;
}

}  // namespace lumigraft::reconstruct
