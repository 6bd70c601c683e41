#include "reconstruct/albedo/surface_lighting.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <unordered_map>

#include "reconstruct/albedo/parameters.h"
#include "reconstruct/albedo/unobserved_occluders.h"
#include "reconstruct/lamps/parameters.h"
#include "reconstruct/light/fluence.h"
#include "reconstruct/light/light.h"
#include "reconstruct/shading/noise_floor.h"

namespace lumigraft::reconstruct {
namespace {

constexpr const AlbedoParameters::Gather& kGather = kAlbedoParameters.gather;

BrickKey cell_of(const Eigen::Vector3f& position, float edge_m) {
  const Eigen::Vector3i cell = (position / edge_m).array().floor().cast<int>();
  return {cell.x(), cell.y(), cell.z()};
}

constexpr const AlbedoParameters::Lighting& kLighting = kAlbedoParameters.lighting;

/// ∂ log E / ∂ log d of a lamp's irradiance at a point; d: distance from the probe, at which its irradiance is fixed.
float distance_slope(const PointLight& light, const Eigen::Vector3f& probe, const Eigen::Vector3f& position,
                     const Eigen::Vector3f& normal) {
  const Eigen::Vector3f offset = light.position_m - position, step = light.position_m - probe;
  const float squared = offset.squaredNorm(), facing = normal.dot(offset);
  if (!(facing > 0)) return 0;
  float slope = 2 + normal.dot(step) / facing - 3 * step.dot(offset) / squared;
  if (light.flat && light.normal.dot(offset) < 0) {
    slope += light.normal.dot(step) / light.normal.dot(offset) - step.dot(offset) / squared;
  }
  return std::clamp(slope, -kLighting.max_distance_slope, kLighting.max_distance_slope);
}

}  // namespace

std::vector<IrradianceModel::Gathered> GatherCache::gather(const IrradianceModel& room,
                                                           const Illumination& illumination,
                                                           const std::vector<SurfaceSample>& samples,
                                                           std::size_t surface_points, int rays) {
  const bool grown = static_cast<double>(surface_points) > kGather.growth * static_cast<double>(points_);
  if (grown || relative_change(illumination, light_) > kGather.max_light_change) {
    forget();
    light_ = illumination;
    points_ = surface_points;
  }
  float edge_m = 1e-3f;
  for (const SurfaceSample& sample : samples) edge_m = std::max(edge_m, kGather.near_cells * sample.size_m);
  std::unordered_map<BrickKey, std::vector<std::size_t>, BrickKeyHash> cells;
  for (std::size_t i = 0; i < entries_.size(); ++i) cells[cell_of(entries_[i].position, edge_m)].push_back(i);

  std::vector<Entry> next;
  std::vector<IrradianceModel::Gathered> result;
  for (const SurfaceSample& sample : samples) {
    const Entry* best = nullptr;
    float nearest = std::pow(kGather.near_cells * sample.size_m, 2.0f);
    const BrickKey cell = cell_of(sample.position, edge_m);
    for (int k = 0; k < 27; ++k) {
      const auto found = cells.find({cell[0] + k % 3 - 1, cell[1] + k / 3 % 3 - 1, cell[2] + k / 9 - 1});
      if (found == cells.end()) continue;
      for (const std::size_t i : found->second) {
        const float away = (entries_[i].position - sample.position).squaredNorm();
        if (away >= nearest || entries_[i].normal.dot(sample.normal) < kGather.same_normal) continue;
        nearest = away;
        best = &entries_[i];
      }
    }
    if (best && best->turn != solves_ % kGather.refresh) {
      next.push_back(*best);
    } else {
      const std::uint32_t turn = best ? best->turn : ++turns_ % kGather.refresh;
      next.push_back({sample.position, sample.normal, room.gather(sample.position, sample.normal, rays), turn});
    }
    result.push_back(next.back().light);
  }
  entries_ = std::move(next);
  ++solves_;
  return result;
}

Eigen::Vector3f gathered_light(const IrradianceModel& room, const IrradianceModel::Gathered& gathered,
                               const std::vector<Eigen::Vector3f>& floor_grid, SurfaceSample& sample) {
  const Eigen::Vector3f of_lamps = room.irradiance_from_floor(gathered, floor_grid);
  const float floor_fraction = gathered.floor_weight * static_cast<float>(gathered.floor_hits.size());
  sample.surface_light = gathered.from_surface;
  sample.floor_light = (of_lamps + floor_fraction * room.surroundings().floor_irradiance).mean();
  return gathered.irradiance + of_lamps;
}

float model_error(const std::vector<SurfaceSample>& samples, float noise_floor, double misfit) {
  if (misfit <= 0) return kLighting.model_error;
  double sum = 0, weights = 1e-9;
  for (const SurfaceSample& sample : samples) {
    if (!sample.usable) continue;
    const double noise = noise_floor_sigma(noise_floor) / (std::numbers::pi * std::max(sample.radiance.mean(), 1e-9f));
    const double variance = std::pow(sample.texture, 2) + noise * noise;
    // As that of a pair of such samples in the misfit.
    const double weight = std::pow(1 + 2 * variance / std::pow(kLampParameters.posterior.pair_scale, 2), -2);
    sum += weight * variance;
    weights += weight;
  }
  return static_cast<float>(std::sqrt(std::max(0.0, misfit * misfit / 2 - sum / weights)));
}

SurfaceLighting::SurfaceLighting(const Surface& surface, const IrradianceModel& room, const Illumination& illumination,
                                 const std::vector<Eigen::Vector3f>& gathered, float noise_floor, float model_error,
                                 const std::vector<SampleAlbedo>& held)
    : surface_(surface),
      room_(room),
      illumination_(illumination),
      gathered_(gathered),
      noise_floor_(noise_floor),
      model_error_(model_error),
      neighbours_(lumigraft::reconstruct::neighbours(surface.samples)) {
  const std::vector<SurfaceSample>& samples = surface.samples;
  for (std::size_t i = 0; i < samples.size(); ++i) sample_light_.push_back({gathered[i], 0});
  const auto lamps = static_cast<Eigen::Index>(illumination.lights.size()),
             count = static_cast<Eigen::Index>(samples.size());
  Eigen::ArrayXXf unoccluded(lamps, count);  // irradiance if nothing occludes the lamps
  for (Eigen::Index i = 0; i < count; ++i) {
    const SurfaceSample& sample = samples[static_cast<std::size_t>(i)];
    for (Eigen::Index lamp = 0; lamp < lamps; ++lamp)
      unoccluded(lamp, i) =
          lamp_irradiance(illumination.lights[static_cast<std::size_t>(lamp)], sample.position, sample.normal).mean();
  }
  const Eigen::ArrayXf of_all = unoccluded.colwise().sum().cwiseMax(1e-9f).transpose();
  visible_.resize(lamps, count);
  for (Eigen::Index lamp = 0; lamp < lamps; ++lamp) {
    const auto own = static_cast<std::size_t>(lamp);
    std::vector<Eigen::Vector3f> irradiance(samples.size());
    for (Eigen::Index k = 0; k < count; ++k) {
      const auto i = static_cast<std::size_t>(k);
      const SurfaceSample& sample = samples[i];
      const int rays = IrradianceModel::rays_for(unoccluded(lamp, k) / of_all[k], kLighting.sample_rays);
      visible_(lamp, k) =
          room.visibility(illumination.lights[own], lamp_distance(own), sample.position, sample.normal, rays);
      irradiance[i] =
          visible_(lamp, k) * lamp_irradiance(illumination.lights[own], sample.position, sample.normal).matrix();
      sample_light_[i].irradiance += irradiance[i];
    }
    from_lamp_.push_back(std::move(irradiance));
  }
  hidden_ = unobserved_shadows(samples, room, illumination.lights, sample_light_, from_lamp_, noise_floor, held);
  for (Eigen::Index lamp = 0; lamp < lamps; ++lamp) {
    const auto own = static_cast<std::size_t>(lamp);
    for (std::size_t i = 0; i < samples.size(); ++i) {
      visible_(lamp, static_cast<Eigen::Index>(i)) *= hidden_.left[own][i];
      sample_light_[i].irradiance -= (1 - hidden_.left[own][i]) * from_lamp_[own][i];
    }
  }
  contrast_.resize(lamps, count);
  point_rays_.resize(lamps, count);
  for (Eigen::Index k = 0; k < count; ++k) {
    const auto i = static_cast<std::size_t>(k);
    const std::vector<Eigen::Vector3f> unmeasured = unmeasured_positions_around(i);
    for (Eigen::Index lamp = 0; lamp < lamps; ++lamp) {
      const auto own = static_cast<std::size_t>(lamp);
      float contrast = std::min(visible_(lamp, k), 1 - visible_(lamp, k));
      for (const int j : neighbours_[i]) contrast = std::max(contrast, std::abs(visible_(lamp, k) - visible_(lamp, j)));
      for (const Eigen::Vector3f& position : unmeasured) {
        const float visibility = hidden_.left[own][i] * room.visibility(illumination.lights[own], lamp_distance(own),
                                                                        position, samples[i].normal, 1);
        contrast = std::max(contrast, std::abs(visible_(lamp, k) - visibility));
      }
      contrast_(lamp, k) = contrast;
    }
    const Eigen::ArrayXf edges = kLighting.edge_error * contrast_.col(k) * unoccluded.col(k);
    const float total = std::max(sample_light_[i].irradiance.mean(), 1e-9f);
    sample_light_[i].relative_sigma = std::hypot(kLighting.model_error, edges.sum() / total);
    const float negligible = kLighting.negligible_edge / std::sqrt(static_cast<float>(lamps)) * total;
    for (Eigen::Index lamp = 0; lamp < lamps; ++lamp)
      point_rays_(lamp, k) = edges[lamp] > negligible
                                 ? IrradianceModel::rays_for(unoccluded(lamp, k) / of_all[k], kLighting.point_rays)
                                 : 0;
  }
}

float SurfaceLighting::lamp_distance(std::size_t lamp) const {
  const PointLight& light = illumination_.lights[lamp];
  return light.distance_known ? (light.position_m - illumination_.probe_position_m).norm() : kInfinitelyFar;
}

std::vector<Eigen::Vector3f> SurfaceLighting::unmeasured_positions_around(std::size_t i) const {
  const SurfaceSample& sample = surface_.samples[i];
  const Eigen::Vector3f x = sample.size_m * sample.normal.unitOrthogonal(), y = sample.normal.cross(x);
  std::vector<Eigen::Vector3f> result;
  for (int k = 0; k < kLighting.directions_around; ++k) {
    const float angle = static_cast<float>(k) * 2 * std::numbers::pi_v<float> / kLighting.directions_around;
    const Eigen::Vector3f position = sample.position + std::cos(angle) * x + std::sin(angle) * y;
    const bool measured = std::any_of(neighbours_[i].begin(), neighbours_[i].end(), [&](int j) {
      return (surface_.samples[static_cast<std::size_t>(j)].position - position).norm() <
             kLighting.max_gap * sample.size_m;
    });
    if (!measured) result.push_back(position);
  }
  return result;
}

std::vector<ObservedShadow> SurfaceLighting::shadows() const {
  constexpr const AlbedoParameters::Carving& kCarving = kAlbedoParameters.carving;
  std::vector<ObservedShadow> result;
  for (std::size_t lamp = 0; lamp < illumination_.lights.size(); ++lamp) {
    ObservedShadow shadow{illumination_.lights[lamp], {}};
    for (std::size_t i = 0; i < surface_.samples.size(); ++i) {
      // A lamp that hardly contributes may be occluded without anybody noticing.
      const bool matters = !hidden_.undecided[lamp][i] &&
                           from_lamp_[lamp][i].sum() >
                               kAlbedoParameters.unobserved.min_lamp_fraction * sample_light_[i].irradiance.sum();
      shadow.samples.push_back(hidden_.left[lamp][i] < kCarving.max_left ? ObservedShadow::State::dark
                               : matters && visible_(static_cast<Eigen::Index>(lamp), static_cast<Eigen::Index>(i)) >
                                                kCarving.min_visible
                                   ? ObservedShadow::State::lit
                                   : ObservedShadow::State::unknown);
    }
    result.push_back(std::move(shadow));
  }
  return result;
}

/// Visibility of lamps at points, by rays where a shadow's edge matters. The points of one sample in a cell of 2³
/// voxels share their rays: by about 2 voxels the field and the poses may be off (FieldParameters::SeenSpace).
class SurfaceLighting::EdgeTracer {
 public:
  explicit EdgeTracer(const SurfaceLighting& lighting)
      : lighting_(lighting), shared_(lighting.visible_.rows(), kCells) {
    sample_.fill(-1);
  }

  /// Points come in the order of Surface::points.
  void at_shadow_edges(const SurfacePoint& point, Eigen::ArrayXf& visible) {
    const auto rays = lighting_.point_rays_.col(point.sample);
    if ((rays == 0).all()) return;
    if (point.brick != brick_) sample_.fill(-1);
    brick_ = point.brick;
    const int cell = (point.index >> 1 & 3) | (point.index >> 4 & 3) << 2 | (point.index >> 7 & 3) << 4;
    int& sample = sample_[static_cast<std::size_t>(cell)];
    if (sample != point.sample) {
      sample = point.sample;
      for (Eigen::Index lamp = 0; lamp < rays.size(); ++lamp)
        if (rays[lamp] > 0) shared_(lamp, cell) = trace(static_cast<std::size_t>(lamp), point, rays[lamp]);
    }
    visible = (rays > 0).select(shared_.col(cell), visible);
  }

 private:
  static constexpr int kCells = kBrickVoxels / 8;

  float trace(std::size_t lamp, const SurfacePoint& point, int rays) const {
    return lighting_.hidden_.left[lamp][static_cast<std::size_t>(point.sample)] *
           lighting_.room_.visibility(lighting_.illumination_.lights[lamp], lighting_.lamp_distance(lamp),
                                      point.position, point.normal, rays);
  }

  const SurfaceLighting& lighting_;
  BrickKey brick_{};
  std::array<int, kCells> sample_{};  ///< whose points share each cell of the brick; at first of none
  Eigen::ArrayXXf shared_;            ///< visibility of each lamp, per cell
};

float SurfaceLighting::sigma_without_model(std::size_t i, const SampleAlbedo& sample) const {
  const float misfit = misfit_sigma(surface_.samples[i], sample_light_[i], sample.albedo, noise_floor_);
  const float noise_fraction = noise_in_data(surface_.samples[i], sample_light_[i], noise_floor_);
  return std::sqrt(misfit * misfit + noise_fraction * std::max(0.0f, sample.sigma * sample.sigma - misfit * misfit));
}

SurfaceLighting::Interpolated SurfaceLighting::interpolate(const SurfacePoint& point,
                                                           const std::vector<SampleAlbedo>& samples) const {
  Interpolated result;
  Eigen::Vector3f gathered = Eigen::Vector3f::Zero(), around = Eigen::Vector3f::Zero();
  result.visible = Eigen::ArrayXf::Zero(visible_.rows());
  float weights = 0, known_weights = 0, sigma = 0, own_sigma = 0, spread = 0, texture = 0;
  const auto add = [&](std::size_t j) {
    const SurfaceSample& sample = surface_.samples[j];
    const float facing = std::max(0.0f, point.normal.dot(sample.normal));
    const float squared = (point.position - sample.position).squaredNorm() / (sample.size_m * sample.size_m);
    const float w = facing * facing * facing * facing / (kLighting.weight_softening + squared) + 1e-6f;
    gathered += w * gathered_[j];
    result.visible += w * visible_.col(static_cast<Eigen::Index>(j));
    weights += w;
    if (samples[j].sigma < 0) return;
    around += w * samples[j].albedo;
    if (sample.known.sigma > 0)
      result.known_ratio += w * (samples[j].albedo.array().max(kLighting.min_albedo) /
                                 lambertian_albedo(sample.radiance, sample_light_[j].irradiance, noise_floor_))
                                    .log();
    sigma += w * samples[j].sigma;
    own_sigma += w * sigma_without_model(j, samples[j]);
    spread += w * sample.spread;
    texture += w * sample.texture;
    known_weights += w;
  };
  const auto own = static_cast<std::size_t>(point.sample);
  add(own);
  for (const int j : neighbours_[own]) add(static_cast<std::size_t>(j));
  result.gathered = gathered / weights;
  result.visible /= weights;
  result.known = known_weights > 0;
  if (!result.known) return result;
  result.albedo = around / known_weights;
  result.known_ratio /= known_weights;
  result.texture = texture / known_weights;
  // With texture the surroundings say less about a point.
  const float of_texture = spread / known_weights * result.albedo.mean();
  result.sigma = std::hypot(sigma / known_weights, of_texture);
  result.own_sigma = std::hypot(own_sigma / known_weights, of_texture);
  return result;
}

std::vector<PointAlbedo> SurfaceLighting::albedo(const std::vector<SampleAlbedo>& samples) const {
  std::vector<PointAlbedo> result(surface_.points.size());
  // Errors of the pieces of one lamp are correlated: its power was estimated for all of them.
  const std::vector<PointLight>& lights = illumination_.lights;
  std::vector<std::size_t> first_piece(lights.size());
  std::vector<float> power_error(lights.size()), distance_error(lights.size());
  EdgeTracer trace(*this);
  for (std::size_t lamp = 0; lamp < lights.size(); ++lamp) {
    std::size_t first = lamp;
    for (std::size_t other = lamp; other-- > 0;)
      if (lights[lamp].region >= 0 && lights[other].region == lights[lamp].region) first = other;
    first_piece[lamp] = first;
  }
  for (std::size_t i = 0; i < surface_.points.size(); ++i) {
    const SurfacePoint& point = surface_.points[i];
    if (point.metal) {
      result[i].sigma = kLighting.metal_sigma;
      continue;
    }
    const auto own = static_cast<std::size_t>(point.sample);
    Interpolated around = interpolate(point, samples);
    trace.at_shadow_edges(point, around.visible);
    Eigen::Vector3f irradiance = around.gathered;
    float edge_squares = 0;  // the lamps' shadows have different edges
    // Radiance of surface, and clipped lamps' power, were found by the camera that measured the point, too.
    float own_scale = surface_.samples[own].surface_light;
    std::fill(power_error.begin(), power_error.end(), 0.0f);
    std::fill(distance_error.begin(), distance_error.end(), 0.0f);
    for (std::size_t lamp = 0; lamp < illumination_.lights.size(); ++lamp) {
      const Eigen::Vector3f unoccluded = lamp_irradiance(lights[lamp], point.position, point.normal).matrix();
      if (unoccluded.isZero()) continue;
      const Eigen::Vector3f from_lamp = around.visible[static_cast<Eigen::Index>(lamp)] * unoccluded;
      irradiance += from_lamp;
      const PointLight& light = lights[lamp];
      own_scale += light.clipped ? from_lamp.mean() : 0;
      power_error[first_piece[lamp]] += light.power_log_sigma * from_lamp.mean();
      if (light.distance_known) {
        distance_error[first_piece[lamp]] +=
            light.distance_log_sigma * from_lamp.mean() *
            distance_slope(light, illumination_.probe_position_m, point.position, point.normal);
      }
      const float edge =
          kLighting.edge_error * contrast_(static_cast<Eigen::Index>(lamp), point.sample) * unoccluded.mean();
      edge_squares += edge * edge;
    }
    float lamp_error = 0;
    for (std::size_t lamp = 0; lamp < lights.size(); ++lamp)
      lamp_error = std::hypot(lamp_error, power_error[lamp], distance_error[lamp]);
    const Eigen::Array3f direct =
        (around.known_ratio.exp() * lambertian_albedo(point.radiance, irradiance, noise_floor_)).min(1.0f);
    if (!around.known) continue;
    const float total = std::max(irradiance.mean(), 1e-9f);
    const float direct_albedo = direct.mean();
    // Half the noise floor, but no less than what it moves albedo towards 1.
    const float noise = noise_floor_sigma(noise_floor_) * std::max(1.0f, 2 * (1 - direct_albedo));
    const float edge_error = std::sqrt(edge_squares);
    const float direct_sigma = std::hypot(edge_error * direct_albedo, noise) / total;
    const float w_direct = 1 / (direct_sigma * direct_sigma + 1e-8f);
    const float w_around = 1 / (around.sigma * around.sigma + 1e-8f);
    result[i].albedo = ((w_direct * direct + w_around * around.albedo.array()) / (w_direct + w_around)).matrix();
    // Errors of the model, of lamps, of shadow edges and of the unseen floor are common to the point and its
    // surroundings: averaging does not reduce them, and they count once, not in the errors of its own, too. Texture
    // within a voxel is as strong as between the voxels of a patch.
    const float floor_error =
        static_cast<float>(kLampParameters.posterior.room_log_sigma) * surface_.samples[own].floor_light;
    const float scale_error = kLighting.scale_error * std::max(0.0f, 1 - own_scale / total);
    const float common = std::hypot(std::hypot(model_error_, scale_error),
                                    std::hypot(lamp_error, floor_error, edge_error) / total, around.texture);
    const float own_sigma = std::hypot(w_direct * noise / total, w_around * around.own_sigma) / (w_direct + w_around);
    result[i].sigma = std::hypot(own_sigma, common * result[i].albedo.mean());
  }
  return result;
}

}  // namespace lumigraft::reconstruct
