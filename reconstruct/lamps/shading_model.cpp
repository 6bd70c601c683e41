#include "reconstruct/lamps/shading_model.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <numbers>

#include "reconstruct/lamps/parameters.h"
#include "reconstruct/shading/noise_floor.h"
#include "reconstruct/shading/parameters.h"

namespace lumigraft::reconstruct {
namespace {

/// Indices into a table and their weights.
using Blend = std::array<std::pair<std::size_t, float>, 4>;

/// Cubic B-spline weights (evenly spaced knots; the ends repeated). They smooth equally at every position. Linear
/// weights are sharp at the knots only, where shadows then fit best and attract the search.
Blend blended(const std::vector<double>& knots, double at) {
  const std::size_t last = knots.size() - 1;
  if (last == 0) return {{{0, 1.0f}}};
  const double position =
      std::clamp((at - knots.front()) / (knots.back() - knots.front()), 0.0, 1.0) * static_cast<double>(last);
  const double low = std::min(std::floor(position), static_cast<double>(last) - 1), t = position - low;
  const double weights[] = {std::pow(1 - t, 3) / 6, (3 * t * t * t - 6 * t * t + 4) / 6,
                            (-3 * t * t * t + 3 * t * t + 3 * t + 1) / 6, t * t * t / 6};
  Blend result;
  for (int k = 0; k < 4; ++k) {
    const double knot = std::clamp(low + k - 1, 0.0, static_cast<double>(last));
    result[static_cast<std::size_t>(k)] = {static_cast<std::size_t>(knot), static_cast<float>(weights[k])};
  }
  return result;
}

/// The disk of a panel instead of a point at its centre. Distances are over that from the probe.
class PanelDisk {
 public:
  /// `facing`: along the normal, its length 1 over the cosine at the probe, by which the disk is foreshortened there.
  PanelDisk(const Eigen::Vector3f& facing, float angular_radius_rad)
      : normal_(facing.normalized()), squared_radius_(std::pow(std::tan(angular_radius_rad), 2.0f) * facing.norm()) {}

  /// Mean of n·v / |v|⁴ over the disk times |v|³ at its centre, which is the cosine for a point: by the second moments
  /// of the disk (Taylor), and exact on its axis, where light falls off with 1 / (d² + R²). `towards`: unit, to the
  /// centre.
  float cosine(const Eigen::Vector3f& n, const Eigen::Vector3f& towards, float squared_distance) const {
    const float radius = squared_radius_ / squared_distance, along = normal_.dot(towards);
    const float fall = radius * (1 - 3 * (1 - along * along));
    const float across = n.dot(towards - along * normal_);
    return n.dot(towards) * (fall > 0 ? 1 / (1 + fall) : 1 - fall) - radius * across;
  }

 private:
  Eigen::Vector3f normal_;
  float squared_radius_;
};

}  // namespace

ShadingModel::ShadingModel(const IrradianceModel& room, const Illumination& illumination,
                           const std::vector<SurfaceSample>& samples, const std::vector<Eigen::Vector3f>& gathered)
    : room_(room),
      probe_(illumination.probe_position_m),
      lights_(illumination.lights),
      samples_(samples),
      gathered_(gathered),
      noise_floor_(noise_floor_radiance(samples)),
      tables_(illumination.lights.size()),
      neighbours_(neighbours(samples)) {
  for (const PointLight& light : lights_) {
    const Eigen::Vector3f first = light.direction.unitOrthogonal();
    across_.push_back({first, light.direction.cross(first)});
  }
  for (const SurfaceSample& sample : samples)
    log_radiance_.push_back((sample.radiance.array() + kTypicalAlbedo * noise_floor_).log());
  for (const SurfaceSample& sample : samples)
    log_known_.push_back(sample.known.albedo.array().max(kLampParameters.pairs.min_albedo).log());
}

void ShadingModel::tabulate(std::size_t lamp, std::vector<double> inverse_distances, int rays) {
  Table& table = tables_[lamp];
  table.inverse_distances = std::move(inverse_distances);
  table.visibility.assign(table.inverse_distances.size(), std::vector<float>(samples_.size(), 0.0f));
  const std::size_t last = table.inverse_distances.size() - 1;
  const double range = table.inverse_distances.back() - table.inverse_distances.front();
  const auto spans = static_cast<std::size_t>(std::ceil(range / kLampParameters.max_visibility_span));
  const std::size_t step = std::max<std::size_t>(1, last / std::max<std::size_t>(spans, 1));
  const auto distance_m = [&](std::size_t k) {
    const double inverse = table.inverse_distances[k];
    return inverse > 0 ? static_cast<float>(1 / inverse) : kInfinitelyFar;
  };
  table.visibility[0] = visibility(lamp, distance_m(0), rays);
  for (std::size_t low = 0, high; low < last; low = high) {
    high = std::min(low + step, last);
    table.visibility[high] = visibility(lamp, distance_m(high), rays);
    for (std::size_t i = 0; i < samples_.size(); ++i) {
      const float before = table.visibility[low][i], after = table.visibility[high][i];
      const bool constant = before == after && (after == 0 || after == 1);
      for (std::size_t k = low + 1; k < high; ++k)
        table.visibility[k][i] =
            constant ? after
                     : room_.visibility(lights_[lamp], distance_m(k), samples_[i].position, samples_[i].normal, rays);
    }
  }
}

std::vector<float> ShadingModel::visibility(std::size_t lamp, float distance_m, int rays) const {
  const auto trace = [&](std::size_t i, int count) {
    return room_.visibility(lights_[lamp], distance_m, samples_[i].position, samples_[i].normal, count);
  };
  std::vector<float> result(samples_.size(), 0.0f);
  for (std::size_t i = 0; i < samples_.size(); ++i)
    if (samples_[i].usable) result[i] = trace(i, 1);
  if (rays == 1) return result;
  std::vector<std::size_t> penumbra;
  std::vector<bool> in_penumbra(samples_.size(), false);
  const auto add = [&](std::size_t i) {
    if (in_penumbra[i] || !samples_[i].usable) return;
    in_penumbra[i] = true;
    penumbra.push_back(i);
  };
  for (std::size_t i = 0; i < samples_.size(); ++i)
    for (const int j : neighbours_[i])
      if (const auto other = static_cast<std::size_t>(j); samples_[other].usable && result[i] != result[other]) {
        add(i);
        add(other);
      }
  for (std::size_t next = 0; next < penumbra.size(); ++next) {
    const std::size_t i = penumbra[next];
    result[i] = trace(i, rays);
    if (result[i] > 0 && result[i] < 1)
      for (const int j : neighbours_[i]) add(static_cast<std::size_t>(j));
  }
  return result;
}

double ShadingModel::inverse_distance_of(const PointLight& placed) const {
  return 1 / (placed.position_m - probe_).norm();
}

/// Normal scaled so that its dot product with a direction is the emission there over that towards the probe.
Eigen::Vector3f ShadingModel::axis(std::size_t lamp, const LampShape& shape) const {
  const PointLight& light = lights_[lamp];
  if (placed(lamp) && light.flat) return light.normal / std::max(-light.normal.dot(light.direction), kMinSlantCosine);
  return -light.direction + static_cast<float>(shape.tilt[0]) * across_[lamp][0] +
         static_cast<float>(shape.tilt[1]) * across_[lamp][1];
}

Eigen::Vector3f ShadingModel::normal(std::size_t lamp, const LampShape& shape) const {
  return axis(lamp, shape).normalized();
}

std::array<double, 2> ShadingModel::tilt_of(std::size_t lamp, const Eigen::Vector3f& normal) const {
  const double along = std::max(-normal.dot(lights_[lamp].direction), kMinSlantCosine);
  return {normal.dot(across_[lamp][0]) / along, normal.dot(across_[lamp][1]) / along};
}

void ShadingModel::factors(std::size_t lamp, const LampShape& shape, std::vector<float>& result) const {
  const Table& table = tables_[lamp];
  const Blend blend = blended(table.inverse_distances, shape.inverse_distance);
  const auto inverse = static_cast<float>(shape.inverse_distance);
  const Eigen::Vector3f facing = axis(lamp, shape);
  const bool panel = shape.flat && !shape.beam;
  const PanelDisk disk(facing, lights_[lamp].angular_radius_rad);
  const float at_probe = panel ? disk.cosine(lights_[lamp].direction, lights_[lamp].direction, 1) : 1;
  result.assign(samples_.size(), 0.0f);
  for (std::size_t i = 0; i < samples_.size(); ++i) {
    float visible = 0;
    for (std::size_t k = 0; k < blend.size(); ++k) visible += blend[k].second * table.visibility[blend[k].first][i];
    if (!(visible > 0)) continue;
    // To the lamp, over its distance from the probe.
    const Eigen::Vector3f offset = lights_[lamp].direction + inverse * (probe_ - samples_[i].position);
    const float squared = offset.squaredNorm(), length = std::sqrt(squared);
    const float cosine = panel ? disk.cosine(samples_[i].normal, offset / length, squared) / at_probe
                               : samples_[i].normal.dot(offset) / length;
    if (!(cosine > 0)) continue;
    const float ahead = std::max(0.0f, -facing.dot(offset) / length);
    const float emission = shape.beam ? ahead * ahead * ahead * ahead : shape.flat ? ahead : 1.0f;
    result[i] = visible * emission * cosine / squared;
  }
}

Eigen::Array3f ShadingModel::power(std::size_t lamp, const LampShape& shape) const {
  Eigen::Array3f result = lights_[lamp].irradiance;
  for (int c = 0; c < 3; ++c) result[c] *= static_cast<float>(std::exp(shape.log_gain[static_cast<std::size_t>(c)]));
  return result;
}

Eigen::Array3f ShadingModel::irradiance(std::size_t sample, const std::vector<Eigen::Array3f>& powers,
                                        const std::vector<std::vector<float>>& factors) const {
  Eigen::Array3f sum = gathered_[sample].array();
  for (std::size_t lamp = 0; lamp < lights_.size(); ++lamp) sum += powers[lamp] * factors[lamp][sample];
  return sum;
}

std::vector<Eigen::Array3f> ShadingModel::irradiance(const std::vector<Eigen::Array3f>& powers,
                                                     const std::vector<std::vector<float>>& factors,
                                                     int without) const {
  std::vector<Eigen::Array3f> result;
  result.reserve(samples_.size());
  for (const Eigen::Vector3f& gathered : gathered_) result.push_back(gathered.array());
  for (std::size_t lamp = 0; lamp < lights_.size(); ++lamp) {
    if (static_cast<int>(lamp) == without) continue;
    for (std::size_t i = 0; i < result.size(); ++i) result[i] += powers[lamp] * factors[lamp][i];
  }
  return result;
}

void ShadingModel::log_albedo(const std::vector<Eigen::Array3f>& others, const Eigen::Array3f& power,
                              const std::vector<float>& factors, std::vector<Eigen::Array3f>& result) const {
  result.resize(2 * samples_.size());
  for (std::size_t i = 0; i < samples_.size(); ++i)
    result[i] = (others[i] + power * factors[i]) * std::numbers::inv_pi_v<float> + noise_floor_;
  // As one array the logarithms are computed four at a time.
  const auto channels = static_cast<Eigen::Index>(3 * samples_.size());
  Eigen::Map<Eigen::ArrayXf> all(result.data()->data(), channels);
  all = Eigen::Map<const Eigen::ArrayXf>(log_radiance_.data()->data(), channels) - all.log();
  std::copy(log_known_.begin(), log_known_.end(), result.begin() + static_cast<std::ptrdiff_t>(samples_.size()));
}

void ShadingModel::log_albedo(const std::vector<Eigen::Array3f>& powers, const std::vector<std::vector<float>>& factors,
                              std::vector<Eigen::Array3f>& result) const {
  const int last = static_cast<int>(lights_.size()) - 1;
  log_albedo(irradiance(powers, factors, last), powers.back(), factors.back(), result);
}

float ShadingModel::information_weight(std::size_t sample, const std::vector<Eigen::Array3f>& powers,
                                       const std::vector<std::vector<float>>& factors) const {
  const float lit = irradiance(sample, powers, factors).mean() * std::numbers::inv_pi_v<float>;
  const float brighter = std::max(lit, samples_[sample].radiance.mean());
  return brighter / (brighter + noise_floor_);
}

Eigen::Array3f ShadingModel::scale_reference(const std::vector<Eigen::Array3f>& values, int paper) const {
  if (paper >= 0) return values[static_cast<std::size_t>(paper)];
  Eigen::Array3d sum = Eigen::Array3d::Zero();
  int count = 0;
  for (std::size_t i = 0; i < samples_.size(); ++i) {
    if (!samples_[i].usable) continue;
    sum += values[i].cast<double>();
    ++count;
  }
  return (sum / std::max(count, 1)).cast<float>();
}

Eigen::Array3f ShadingModel::slope(std::size_t sample, const std::vector<Eigen::Array3f>& powers,
                                   const std::vector<std::vector<float>>& factors) const {
  return -1 / (irradiance(sample, powers, factors) + noise_floor_ * std::numbers::pi_v<float>);
}

}  // namespace lumigraft::reconstruct
