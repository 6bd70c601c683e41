#include "reconstruct/light/environment.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "reconstruct/light/parameters.h"

namespace lumigraft::reconstruct {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr int kSubsamples = kLightParameters.environment.subsamples;

Eigen::Vector3d direction_at(double u, double v, int width, int height) {
  const double phi = 2 * kPi * (u + 0.5) / width - kPi, theta = kPi * (v + 0.5) / height;
  return {std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta)};
}

}  // namespace

FisheyeView fisheye_view(const capture::FisheyeCamera& camera) {
  const capture::CameraModel& model = camera.model;
  FisheyeView view;
  view.width = model.width;
  view.height = model.height;
  const std::size_t pixels = static_cast<std::size_t>(model.width) * model.height;
  view.direction.assign(pixels, Eigen::Vector3f::Zero());
  view.solid_angle_sr.assign(pixels, 0.0f);
  const Eigen::Matrix3d R_tag_fisheye = camera.T_tag_fisheye.linear();
  for (int v = 0; v < model.height; ++v) {
    for (int u = 0; u < model.width; ++u) {
      const auto direction = model.unproject(Eigen::Vector2d(u, v));
      if (!direction) continue;
      const std::size_t pixel = static_cast<std::size_t>(v) * model.width + u;
      view.direction[pixel] = (R_tag_fisheye * *direction).cast<float>();
      view.solid_angle_sr[pixel] = static_cast<float>(model.solid_angle_sr(u, v));
    }
  }
  return view;
}

Eigen::Vector3f environment_direction(int u, int v, int width, int height) {
  return direction_at(u, v, width, height).cast<float>();
}

float environment_solid_angle_sr(int v, int width, int height) {
  return static_cast<float>(2 * kPi / width * (std::cos(kPi * v / height) - std::cos(kPi * (v + 1) / height)));
}

Eigen::Vector3f EnvironmentMap::sample(const Eigen::Vector3f& direction) const {
  const int width = radiance.width, height = radiance.height;
  const float phi = std::atan2(direction.y(), direction.x());
  const float theta = std::atan2(std::hypot(direction.x(), direction.y()), direction.z());
  const float u = (phi / static_cast<float>(kPi) + 1) * 0.5f * width - 0.5f;
  const float v = std::clamp(theta / static_cast<float>(kPi) * height - 0.5f, 0.0f, height - 1.0f);
  const float u_low = std::floor(u), v_low = std::floor(v);
  const float fu = u - u_low, fv = v - v_low;
  const int u0 = (static_cast<int>(u_low) + width) % width, u1 = (u0 + 1) % width;
  const int v0 = static_cast<int>(v_low), v1 = std::min(v0 + 1, height - 1);
  Eigen::Vector3f result;
  for (int c = 0; c < 3; ++c) {
    result[c] = (1 - fv) * ((1 - fu) * radiance.at(u0, v0, c) + fu * radiance.at(u1, v0, c)) +
                fv * ((1 - fu) * radiance.at(u0, v1, c) + fu * radiance.at(u1, v1, c));
  }
  return result;
}

EnvironmentResampler::EnvironmentResampler(const capture::FisheyeCamera& camera, const FisheyeView& view, int width,
                                           int height)
    : width_(width), height_(height) {
  const Eigen::Matrix3d R_fisheye_tag = camera.T_tag_fisheye.linear().transpose();
  const std::size_t cells = static_cast<std::size_t>(width) * height;
  seen_fraction_.assign(cells, 0.0f);
  std::vector<std::uint32_t> seen;
  std::vector<Eigen::Vector3f> directions(cells);
  for (int v = 0; v < height; ++v) {
    cell_solid_angle_.push_back(environment_solid_angle_sr(v, width, height));
    for (int u = 0; u < width; ++u) {
      const std::uint32_t cell = static_cast<std::uint32_t>(v) * width + u;
      directions[cell] = environment_direction(u, v, width, height);
      pixel_begin_.push_back(static_cast<std::uint32_t>(pixels_.size()));
      for (int i = 0; i < kSubsamples * kSubsamples; ++i) {
        const double du = (i % kSubsamples + 0.5) / kSubsamples - 0.5, dv = (i / kSubsamples + 0.5) / kSubsamples - 0.5;
        const auto pixel = camera.model.project(R_fisheye_tag * direction_at(u + du, v + dv, width, height));
        if (!pixel || !camera.model.inside(*pixel)) continue;
        const auto index = static_cast<std::uint32_t>(std::lround(pixel->y()) * view.width + std::lround(pixel->x()));
        if (view.sees(index)) pixels_.push_back(index);
      }
      const std::size_t found = pixels_.size() - pixel_begin_.back();
      seen_fraction_[cell] = static_cast<float>(found) / (kSubsamples * kSubsamples);
      (found > 0 ? seen : unseen_).push_back(cell);
    }
  }
  pixel_begin_.push_back(static_cast<std::uint32_t>(pixels_.size()));

  for (const std::uint32_t cell : unseen_) {
    nearest_begin_.push_back(static_cast<std::uint32_t>(nearest_.size()));
    float best = -1;
    for (const std::uint32_t other : seen) best = std::max(best, directions[cell].dot(directions[other]));
    const float limit =
        std::cos(std::min(std::acos(std::min(best, 1.0f)) + kLightParameters.environment.fill_margin_rad, 3.14f));
    for (const std::uint32_t other : seen) {
      if (directions[cell].dot(directions[other]) >= limit) nearest_.push_back(other);
    }
  }
  nearest_begin_.push_back(static_cast<std::uint32_t>(nearest_.size()));
}

EnvironmentMap EnvironmentResampler::resample(const capture::Image<float>& radiance, const FisheyeView& view,
                                              const capture::Image<std::uint8_t>* clipped) const {
  Eigen::Vector3d picture_total = Eigen::Vector3d::Zero(), cell_total = Eigen::Vector3d::Zero();
  for (std::size_t pixel = 0; pixel < view.solid_angle_sr.size(); ++pixel) {
    for (int c = 0; c < 3; ++c) picture_total[c] += double(radiance.data[3 * pixel + c]) * view.solid_angle_sr[pixel];
  }
  EnvironmentMap result;
  result.radiance = capture::Image<float>(width_, height_, 3);
  result.seen = capture::Image<std::uint8_t>(width_, height_, 1, 1);
  const std::size_t cells = seen_fraction_.size();
  for (std::size_t cell = 0; cell < cells; ++cell) {
    const std::uint32_t begin = pixel_begin_[cell], end = pixel_begin_[cell + 1];
    if (begin == end) continue;
    if (clipped && std::any_of(&pixels_[begin], &pixels_[begin] + (end - begin),
                               [&](std::uint32_t pixel) { return clipped->data[pixel] != 0; })) {
      if (result.clipped.empty()) result.clipped = capture::Image<std::uint8_t>(width_, height_, 1);
      result.clipped.data[cell] = 1;
    }
    const double weight = double(cell_solid_angle_[cell / width_]) * seen_fraction_[cell];
    for (int c = 0; c < 3; ++c) {
      double sum = 0;
      for (std::uint32_t i = begin; i < end; ++i) sum += radiance.data[3 * std::size_t{pixels_[i]} + c];
      const double mean = sum / (end - begin);
      result.radiance.data[3 * cell + c] = static_cast<float>(mean);
      cell_total[c] += mean * weight;
    }
  }
  for (int c = 0; c < 3; ++c) {
    if (!(cell_total[c] > 0)) continue;
    const float scale = static_cast<float>(picture_total[c] / cell_total[c]);
    for (std::size_t cell = 0; cell < cells; ++cell) result.radiance.data[3 * cell + c] *= scale;
  }
  for (std::size_t i = 0; i < unseen_.size(); ++i) {
    result.seen.data[unseen_[i]] = 0;
    Eigen::Vector3d sum = Eigen::Vector3d::Zero();
    double weight_sum = 0;
    for (std::uint32_t j = nearest_begin_[i]; j < nearest_begin_[i + 1]; ++j) {
      const std::size_t other = nearest_[j];
      const double weight = double(cell_solid_angle_[other / width_]) * seen_fraction_[other];
      for (int c = 0; c < 3; ++c) sum[c] += weight * result.radiance.data[3 * other + c];
      weight_sum += weight;
    }
    if (!(weight_sum > 0)) continue;
    for (int c = 0; c < 3; ++c) result.radiance.data[3 * std::size_t{unseen_[i]} + c] = float(sum[c] / weight_sum);
  }
  return result;
}

void add_disk(EnvironmentMap& map, const Eigen::Vector3f& direction, float radius_rad, const Eigen::Vector3f& energy) {
  capture::Image<float>& radiance = map.radiance;
  std::vector<std::size_t> cells;
  double covered = 0;
  // A disk smaller than a cell covers the cell that it lies in.
  const float reach = std::cos(std::max(radius_rad, 1.5f * static_cast<float>(kPi) / radiance.height));
  for (int v = 0; v < radiance.height; ++v) {
    for (int u = 0; u < radiance.width; ++u) {
      if (environment_direction(u, v, radiance.width, radiance.height).dot(direction) < reach) continue;
      cells.push_back(radiance.index(u, v));
      covered += environment_solid_angle_sr(v, radiance.width, radiance.height);
    }
  }
  for (const std::size_t cell : cells) {
    for (int c = 0; c < 3; ++c) radiance.data[cell + c] += static_cast<float>(energy[c] / covered);
  }
}

Sh9 project_sh(const EnvironmentMap& map) {
  const capture::Image<float>& radiance = map.radiance;
  std::array<Eigen::Vector3d, 9> sum;
  sum.fill(Eigen::Vector3d::Zero());
  for (int v = 0; v < radiance.height; ++v) {
    const double solid_angle = environment_solid_angle_sr(v, radiance.width, radiance.height);
    for (int u = 0; u < radiance.width; ++u) {
      const auto basis = sh_basis(environment_direction(u, v, radiance.width, radiance.height));
      for (int c = 0; c < 3; ++c) {
        const double energy = solid_angle * radiance.at(u, v, c);
        for (std::size_t i = 0; i < 9; ++i) sum[i][c] += energy * basis[i];
      }
    }
  }
  Sh9 result;
  for (std::size_t i = 0; i < 9; ++i) result[i] = sum[i].cast<float>();
  return result;
}

}  // namespace lumigraft::reconstruct
