// Poses by depth against a noisy surface of one, two and three plane directions. One plane leaves two translations and
// a rotation open, two leave a translation: there the pose must keep the prior and say so.
#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <random>

#include "reconstruct/pose/icp.h"
#include "tests/reconstruct/fusion/fusion_views.h"
#include "tests/sweeps/sweep.h"

namespace lumigraft::test {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;
using reconstruct::PoseCovariance;
using Step = Eigen::Matrix<double, 6, 1>;

constexpr double kPriorSigma = 0.01;  ///< metres and radians
constexpr int kFields = 2, kTrials = 56;

/// The floor, and up to two walls.
Shape corner(int planes) {
  return [=](const Vector3d& p) {
    double free = p.z();
    if (planes > 1) free = std::min(free, 0.6 - p.x());
    return planes > 2 ? std::min(free, 0.6 - p.y()) : free;
  };
}

/// Along the principal directions of the covariance, from the best to the least determined.
struct Directions {
  Step error = Step::Zero(), sigma = Step::Zero();  ///< sums over trials
  double worst_sigmas = 0;
  int found = 0, within_sigma = 0;
};

/// Poses up to 1.7 σ of the prior away along each axis, against a field fused from noisy frames.
Directions errors(int planes, double noise) {
  const capture::CameraModel camera = small_camera();
  const reconstruct::DepthSampler sampler(camera);
  const Shape shape = corner(planes);
  std::mt19937 random(static_cast<unsigned>(10 * noise) + static_cast<unsigned>(planes));
  std::uniform_real_distribution<double> offset(-1.7 * kPriorSigma, 1.7 * kPriorSigma);
  Directions result;
  for (int f = 0; f < kFields; ++f) {
    const auto view = [&](int i) {
      return looking_at_tag(1.4 + 0.004 * i, 45 * kDegree, -2.4 + 0.2 * f + 0.004 * i, {0.15, 0.15, 0.1});
    };
    reconstruct::FusionStage stage(session_with(camera), {});
    std::shared_ptr<const reconstruct::DistanceField> field;
    unsigned seed = 1000u * static_cast<unsigned>(f);
    for (int i = 0; i < 16; ++i)
      field = stage.fuse(frame_of(shape, camera, view(i), static_cast<std::uint64_t>(i), {noise, ++seed}),
                         pose_at(view(i)));
    for (int t = 0; t < kTrials; ++t) {
      const Step step = Step::NullaryExpr([&] { return offset(random); });
      const Isometry3d truth = reconstruct::apply_step(view(8), step);
      const auto grid = sampler.sample(frame_of(shape, camera, truth, 0, {noise, ++seed}).depth->depth_m);
      const auto fit = align_to_field(
          grid, *field, {view(8), PoseCovariance(kPriorSigma * kPriorSigma * PoseCovariance::Identity())});
      if (!fit) continue;
      const Eigen::SelfAdjointEigenSolver<PoseCovariance> principal(fit->pose.covariance);
      const Step error =
          (principal.eigenvectors().transpose() * reconstruct::step_between(fit->pose.T_tag_camera, truth)).cwiseAbs();
      const Step sigma = principal.eigenvalues().cwiseSqrt();
      result.error += error;
      result.sigma += sigma;
      result.worst_sigmas = std::max(result.worst_sigmas, error.cwiseQuotient(sigma).maxCoeff());
      result.within_sigma += static_cast<int>((error.array() < sigma.array()).count());
      ++result.found;
    }
  }
  return result;
}

TEST(SurfacePoseSweep, PlaneDirections) {
  Sweep sweep{.stem = "pose-planes",
              .title = "Pose by depth against planes, 112 poses each, prior of 10 mm and 10 mrad",
              .x_label = "depth noise, of a Kinect's",
              .y_label = "largest error, in its reported 1σ",
              .x = {0.5, 1, 1.5},
              .curves = {{"one plane"}, {"two"}, {"three"}},
              .logarithmic = true,
              .max = 3};
  for (int planes = 1; planes <= 3; ++planes)
    for (const double noise : sweep.x) {
      const Directions found = errors(planes, noise);
      ASSERT_GE(found.found, 0.95 * kFields * kTrials) << planes << " planes, noise " << noise;
      std::printf("pose: %d planes, noise %.1f: mean error/1σ, 1e-3 m or rad:", planes, noise);
      for (int d = 0; d < 6; ++d)
        std::printf(" %.2f/%.2f", 1e3 * found.error[d] / found.found, 1e3 * found.sigma[d] / found.found);
      std::printf("; %d %% within 1σ, worst %.1fσ\n", 100 * found.within_sigma / (6 * found.found), found.worst_sigmas);
      sweep.curves[static_cast<std::size_t>(planes - 1)].y.push_back(found.worst_sigmas);
      EXPECT_LT(found.worst_sigmas, sweep.max) << planes << " planes, noise " << noise;
      // Determined directions are found to a tenth of the prior and better, open ones keep most of it.
      const int open = planes == 1 ? 3 : planes == 2 ? 1 : 0;
      EXPECT_LT(found.sigma[5 - open], 0.25 * kPriorSigma * found.found) << planes << " planes, noise " << noise;
      if (open > 0) {
        EXPECT_GT(found.sigma[6 - open], 0.6 * kPriorSigma * found.found) << planes << " planes, noise " << noise;
      }
    }
  write_sweep(sweep);
}

}  // namespace
}  // namespace lumigraft::test
