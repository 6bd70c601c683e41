#include "reconstruct/albedo/sample_solver.h"

#include <ceres/ceres.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "reconstruct/albedo/parameters.h"
#include "reconstruct/shading/noise_floor.h"

namespace lumigraft::reconstruct {
namespace {

constexpr float kPi = std::numbers::pi_v<float>;
constexpr const AlbedoParameters::Solver& kSolver = kAlbedoParameters.solver;

/// (π B - a E) / σ, per channel.
struct Data {
  std::array<double, 3> radiance, irradiance, sigma;
  template <typename T>
  bool operator()(const T* albedo, T* residual) const {
    for (std::size_t c = 0; c < 3; ++c) residual[c] = (albedo[c] * irradiance[c] - kPi * radiance[c]) / sigma[c];
    return true;
  }
};

/// (a - a₀) / σ of albedo that is known from earlier light.
struct Known {
  Eigen::Vector3d albedo;
  double sigma;
  template <typename T>
  bool operator()(const T* a, T* residual) const {
    for (int c = 0; c < 3; ++c) residual[c] = (a[c] - albedo[c]) / sigma;
    return true;
  }
};

struct Smooth {
  double weight;
  template <typename T>
  bool operator()(const T* a, const T* b, T* residual) const {
    for (int c = 0; c < 3; ++c) residual[c] = weight * (a[c] - b[c]);
    return true;
  }
};

Eigen::Array3f direct(const SurfaceSample& sample, const SampleLight& light, float noise_floor) {
  return lambertian_albedo(sample.radiance, light.irradiance, noise_floor);
}

/// 1σ of π B: noise floor and model error.
Eigen::Array3f data_sigma(const SurfaceSample& sample, const SampleLight& light, float noise_floor) {
  const Eigen::Array3f model = light.relative_sigma * kPi * sample.radiance.array();
  return (model.square() + std::pow(noise_floor_sigma(noise_floor), 2.0f)).sqrt();
}

/// Adds smoothness between neighbours, of which at least one is among the first `open` samples, and its `information`.
void add_smoothness(ceres::Problem& problem, const std::vector<SurfaceSample>& samples,
                    const std::vector<SampleLight>& light, const std::vector<std::vector<int>>& neighbours,
                    float noise_floor, std::size_t open, std::vector<std::array<double, 3>>& albedo,
                    std::vector<double>& information) {
  const std::vector<double> data_information = information;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    for (const int j : neighbours[i]) {
      const auto other = static_cast<std::size_t>(j);
      if (other < i && std::count(neighbours[other].begin(), neighbours[other].end(), static_cast<int>(i))) continue;
      if (i >= open && other >= open) continue;
      // At a shadow's edge the light is uncertain, so that a step of B / E is not an edge of albedo.
      const Eigen::Array3f step =
          (direct(samples[i], light[i], noise_floor) / direct(samples[other], light[other], noise_floor)).log();
      const double sigma = std::hypot(kSolver.edge_sigma, light[i].relative_sigma, light[other].relative_sigma);
      const double weight = std::exp(-0.5 * step.square().mean() / (sigma * sigma)) / kSolver.smooth_sigma;
      if (weight * kSolver.smooth_sigma < kSolver.min_weight) continue;
      problem.AddResidualBlock(new ceres::AutoDiffCostFunction<Smooth, 3, 3, 3>(new Smooth{weight}),
                               new ceres::HuberLoss(kSolver.huber), albedo[i].data(), albedo[other].data());
      // A neighbour adds at most its own information.
      const double link = weight * weight;
      information[i] += link * data_information[other] / (link + data_information[other]);
      information[other] += link * data_information[i] / (link + data_information[i]);
    }
  }
}

void minimise(ceres::Problem& problem) {
  ceres::Solver::Options options;
  options.linear_solver_type = ceres::CGNR;
  options.max_num_iterations = kSolver.iterations;
  options.max_linear_solver_iterations = kSolver.linear_iterations;
  options.function_tolerance = kSolver.tolerance;
  options.num_threads = 1;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
}

}  // namespace

std::vector<SampleAlbedo> solve_albedo(const std::vector<SurfaceSample>& samples, const std::vector<SampleLight>& light,
                                       const std::vector<std::vector<int>>& neighbours, float noise_floor,
                                       const std::vector<SampleAlbedo>& held) {
  if (samples.empty()) return {};
  std::vector<std::array<double, 3>> albedo(samples.size());
  std::vector<double> information(samples.size(), 0.0);  // 1/σ² of albedo, mean of channels
  const std::size_t open = samples.size() - held.size();
  ceres::Problem problem;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const Eigen::Array3f start = direct(samples[i], light[i], noise_floor),
                         sigma = data_sigma(samples[i], light[i], noise_floor);
    auto* data = new Data;
    for (std::size_t c = 0; c < 3; ++c) {
      const auto k = static_cast<Eigen::Index>(c);
      albedo[i][c] = std::clamp<double>(start[k], 0.0, 1.0);
      data->radiance[c] = samples[i].radiance[k];
      data->irradiance[c] = light[i].irradiance[k];
      data->sigma[c] = sigma[k];
      information[i] += std::pow(data->irradiance[c] / data->sigma[c], 2) / 3;
      if (i >= open) albedo[i][c] = held[i - open].albedo[k];
    }
    problem.AddResidualBlock(new ceres::AutoDiffCostFunction<Data, 3, 3>(data), new ceres::HuberLoss(kSolver.huber),
                             albedo[i].data());
    for (int c = 0; c < 3; ++c) {
      problem.SetParameterLowerBound(albedo[i].data(), c, 0.0);
      problem.SetParameterUpperBound(albedo[i].data(), c, 1.0);
    }
    if (i >= open) problem.SetParameterBlockConstant(albedo[i].data());
    if (const SampleAlbedo& known = samples[i].known; known.sigma > 0) {
      problem.AddResidualBlock(
          new ceres::AutoDiffCostFunction<Known, 3, 3>(new Known{known.albedo.cast<double>(), known.sigma}),
          new ceres::HuberLoss(kSolver.huber), albedo[i].data());
      information[i] += 1 / (known.sigma * known.sigma);
    }
  }
  add_smoothness(problem, samples, light, neighbours, noise_floor, open, albedo, information);
  minimise(problem);

  std::vector<SampleAlbedo> result(samples.size());
  std::copy(held.begin(), held.end(), result.begin() + static_cast<std::ptrdiff_t>(open));
  for (std::size_t i = 0; i < open; ++i) {
    for (std::size_t c = 0; c < 3; ++c)
      result[i].albedo[static_cast<Eigen::Index>(c)] = static_cast<float>(albedo[i][c]);
    const double sigma = std::hypot(1 / std::sqrt(std::max(information[i], 1e-9)),
                                    misfit_sigma(samples[i], light[i], result[i].albedo, noise_floor));
    result[i].sigma = sigma < kSolver.max_sigma ? static_cast<float>(sigma) : -1;
  }
  return result;
}

float misfit_sigma(const SurfaceSample& sample, const SampleLight& light, const Eigen::Vector3f& albedo,
                   float noise_floor) {
  const float misfit = (albedo.array() - direct(sample, light, noise_floor)).abs().mean();
  const double trust = std::min(1.0, kSolver.trusted_error / std::max(light.relative_sigma, 0.01f));
  return static_cast<float>(kSolver.misfit_sigma * trust) * misfit;
}

float noise_in_data(const SurfaceSample& sample, const SampleLight& light, float noise_floor) {
  return (std::pow(noise_floor_sigma(noise_floor), 2.0f) / data_sigma(sample, light, noise_floor).square()).mean();
}

}  // namespace lumigraft::reconstruct
