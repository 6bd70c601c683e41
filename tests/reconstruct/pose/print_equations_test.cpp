// Normal equations of eight pixels at a time against those of single pixels in double precision.
#include "reconstruct/pose/print_equations.h"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <string>

#include "reconstruct/math/planar_pose.h"
#include "reconstruct/pose/tag_print.h"
#include "tests/reconstruct/pose/pose_views.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector2d;
using Eigen::Vector3d;
using test::kDegree;

/// One pixel after the other, in double precision.
class ScalarEquations {
 public:
  ScalarEquations(const std::vector<PixelSample>& pixels, const PrintIntegral& print, const TagPattern& pattern,
                  double size_m)
      : pixels_(pixels),
        print_(print),
        cell_m_(size_m / pattern.square_cells),
        half_cells_(pattern.cells / 2.0),
        half_m_(size_m / 2) {}

  PrintFit linearise(const Isometry3d& pose, const PrintAppearance& appearance, double limit, double hold) const {
    PrintFit fit;
    fit.jtj(10, 10) = hold * hold;
    fit.jtr[10] = hold * hold * (appearance.blur - 1);
    fit.error = hold * hold * (appearance.blur - 1) * (appearance.blur - 1);
    const Eigen::Matrix3d to_tag = pose.linear().transpose();
    const Vector3d normal = pose.linear().col(2), centre = pose.translation();
    const double height_m = normal.dot(centre);
    const double contrast_per_m = (appearance.paper - appearance.ink) / cell_m_;
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

struct View {
  const char* name;
  double distance_m, tilt_deg, blur;
  std::uint8_t lit;  ///< added to all codes: paper clips
};

class PrintEquationsOfView : public testing::TestWithParam<View> {};

TEST_P(PrintEquationsOfView, AreThoseOfSinglePixels) {
  const View& view = GetParam();
  const TagFinder finder(test::some_tag());
  const TagPattern& pattern = finder.pattern();
  const capture::CameraModel camera = test::small_camera();
  const Isometry3d truth = test::looking_at_tag(view.distance_m, view.tilt_deg * kDegree, -1.2);
  capture::Frame picture = test::view_of_tag(camera, pattern, 0.16, truth);
  for (std::uint8_t& code : picture.encoded.data) code = static_cast<std::uint8_t>(std::min(255, code + view.lit));
  TagCorners corners;
  for (int i = 0; i < 4; ++i) corners[i] = *camera.project(truth.inverse() * tag_corners(0.16)[i]);
  const std::vector<PixelSample> pixels = sample_pixels(picture, capture::Response::srgb(), camera,
                                                        region_of_print(corners, pattern, camera.width, camera.height));
  ASSERT_GT(pixels.size(), 100u);
  const PrintIntegral print(pattern);
  const ScalarEquations scalar(pixels, print, pattern, 0.16);
  const PrintEquations equations(pixels, pattern, 0.16);
  Isometry3d pose = truth.inverse();  // some pixels off, so that residuals are on both sides of Huber's threshold
  pose.translation() += Vector3d(0.002, -0.001, 0.004);
  const PrintAppearance appearance{.ink = 0.05, .paper = 0.7, .slope_x = 0.02, .slope_y = -0.03, .blur = view.blur};
  const PrintFit slow = scalar.linearise(pose, appearance, 0.1, 0.02);
  const PrintFit fast = equations.linearise(pose, appearance, 0.1, 0.02);

  EXPECT_EQ(fast.used, slow.used);
  EXPECT_NEAR(fast.edges, slow.edges, 2);  // white is 0.01 or 0.99 within the rounding of single precision
  EXPECT_NEAR(fast.clipped_edges, slow.clipped_edges, 2);
  EXPECT_NEAR(fast.error, slow.error, 1e-4 * slow.error);
  // A pixel whose residual or footprint is at a threshold within rounding may count on its other side.
  const PrintVector size = slow.jtj.diagonal().cwiseSqrt();
  for (int row = 0; row < kPrintUnknowns; ++row) {
    EXPECT_NEAR(fast.jtr[row], slow.jtr[row], 1e-4 * size[row] * std::sqrt(slow.error)) << row;
    for (int column = 0; column < kPrintUnknowns; ++column)
      EXPECT_NEAR(fast.jtj(row, column), slow.jtj(row, column), 1e-4 * size[row] * size[column])
          << row << ' ' << column;
  }
  // The step is what counts.
  const PrintVector slow_step = slow.jtj.ldlt().solve(slow.jtr), fast_step = fast.jtj.ldlt().solve(fast.jtr);
  EXPECT_LT(std::sqrt((fast_step - slow_step).dot(slow.jtj * (fast_step - slow_step))),
            1e-3 * std::sqrt(slow_step.dot(slow.jtj * slow_step)));
}

INSTANTIATE_TEST_SUITE_P(Views, PrintEquationsOfView,
                         testing::Values(View{"near", 0.5, 30, 1.3, 0}, View{"tilted", 0.6, 70, 1.3, 0},
                                         View{"far", 2.5, 30, 1.3, 0}, View{"blurred", 0.8, 40, 3.5, 0},
                                         View{"sharp", 0.8, 40, 1, 0}, View{"clipped", 0.7, 40, 1.3, 100}),
                         [](const auto& view) { return std::string(view.param.name); });

}  // namespace
}  // namespace lumigraft::reconstruct
