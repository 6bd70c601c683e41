#include "reconstruct/shading/clipped_walls.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "reconstruct/light/environment.h"
#include "reconstruct/light/parameters.h"
#include "reconstruct/shading/parameters.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Vector3f;

constexpr const ShadingParameters::ClippedWalls& kWalls = kShadingParameters.clipped_walls;

class ClippedWalls {
 public:
  ClippedWalls(Illumination& light, const std::vector<PointLight>& lamps, const Enclosure* room,
               const DistanceField& field, const FieldRays& rays, const MetalMask& metal)
      : light_(light),
        picture_(light.environment),
        lamps_(lamps),
        room_(room),
        field_(field),
        rays_(rays),
        metal_(metal),
        width_(picture_.radiance.width),
        height_(picture_.radiance.height) {
    for (int v = 0; v < height_; ++v)
      for (int u = 0; u < width_; ++u) direction_.push_back(environment_direction(u, v, width_, height_));
  }

  void raise() {
    const capture::Image<float> before = picture_.radiance;
    find_sides();
    for (std::size_t cell = 0; cell < side_.size(); ++cell) {
      if (!picture_.clipped.data[cell]) continue;
      std::optional<Vector3f> radiance = measured(cell);
      if (!radiance) radiance = modelled(cell, before);
      if (!radiance) continue;
      for (int c = 0; c < 3; ++c) {
        float& value = picture_.radiance.data[3 * cell + c];
        value = std::max(value, std::min((*radiance)[c], kWalls.max_gain * value));
      }
    }
    fill_unseen(before);
    light_.environment_sh = project_sh(picture_);
  }

 private:
  bool seen(std::size_t cell) const { return picture_.seen.empty() || picture_.seen.data[cell] != 0; }

  void find_sides() {
    side_.assign(static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_), -1);
    for (std::size_t cell = 0; room_ && cell < side_.size(); ++cell) {
      if (!seen(cell)) continue;
      const auto exit = room_->leave(light_.probe_position_m, direction_[cell]);
      if (!exit || !room_->sides[exit->side].measured) continue;
      const auto hit = rays_.first_crossing(light_.probe_position_m, direction_[cell], kShadingParameters.max_ray_m);
      if (hit && (*hit - light_.probe_position_m).norm() < kShadingParameters.on_side_ratio * exit->distance_m)
        continue;
      side_[cell] = static_cast<int>(exit->side);
    }
  }

  /// Radiance measured by the colour camera.
  std::optional<Vector3f> measured(std::size_t cell) const {
    const auto hit = rays_.first_crossing(light_.probe_position_m, direction_[cell], kShadingParameters.max_ray_m);
    return hit && !metal_.contains(*hit) ? field_.radiance(*hit) : std::nullopt;
  }

  /// Irradiance of the side that a cell shows, mean over the cell.
  Vector3f irradiance(std::size_t cell) const {
    const Enclosure::Side& side = room_->sides[static_cast<std::size_t>(side_[cell])];
    Vector3f sum = Vector3f::Zero();
    int count = 0;
    for (int i = 0; i < kWalls.samples * kWalls.samples; ++i) {
      const auto off = [&](int k) { return (static_cast<float>(k) + 0.5f) / kWalls.samples - 0.5f; };
      const float phi =
          2 * std::numbers::pi_v<float> *
              (static_cast<float>(cell % static_cast<std::size_t>(width_)) + 0.5f + off(i % kWalls.samples)) /
              static_cast<float>(width_) -
          std::numbers::pi_v<float>;
      const float theta =
          std::numbers::pi_v<float> *
          (static_cast<float>(cell / static_cast<std::size_t>(width_)) + 0.5f + off(i / kWalls.samples)) /
          static_cast<float>(height_);
      const Vector3f towards(std::sin(theta) * std::cos(phi), std::sin(theta) * std::sin(phi), std::cos(theta));
      const float descent = -side.normal.dot(towards);
      const float height_m = side.normal.dot(light_.probe_position_m) + side.offset_m;
      if (descent < 1e-3f || height_m <= 0) continue;
      const Vector3f point = light_.probe_position_m + height_m / descent * towards;
      ++count;
      sum += sh_irradiance(light_.environment_sh, side.normal).cwiseMax(0.0f);
      for (const PointLight& lamp : lamps_) {
        if (!lamp.distance_known) continue;
        const Vector3f offset = lamp.position_m - point;
        const float arriving =
            std::max(0.0f, side.normal.dot(offset.normalized())) * lamp.emission(-offset.normalized());
        if (arriving <= 0 ||
            !rays_.free(point + kWalls.lift_m * side.normal,
                        lamp.position_m - kShadingParameters.lamp_radii_clear * lamp.radius_m * offset.normalized()))
          continue;
        sum += arriving / offset.squaredNorm() * lamp.intensity;
      }
    }
    return count > 0 ? Vector3f(sum / static_cast<float>(count)) : Vector3f::Zero();
  }

  /// Radiance from the albedo of the same side's unclipped cells, weighted by 1/angle⁴.
  std::optional<Vector3f> modelled(std::size_t cell, const capture::Image<float>& before) {
    if (side_[cell] < 0) return std::nullopt;
    if (irradiance_.empty()) {
      for (std::size_t i = 0; i < side_.size(); ++i)
        irradiance_.push_back(side_[i] >= 0 ? irradiance(i) : Vector3f::Zero());
      for (const Vector3f& value : irradiance_) brightest_ = std::max(brightest_, value.mean());
    }
    Vector3f sum = Vector3f::Zero();
    float weights = 0;
    for (std::size_t i = 0; i < side_.size(); ++i) {
      if (side_[i] != side_[cell] || picture_.clipped.data[i] ||
          irradiance_[i].minCoeff() < kWalls.min_irradiance_ratio * brightest_)
        continue;
      const float squared = 2 - 2 * direction_[i].dot(direction_[cell]) + 1e-3f;
      const float w = 1 / (squared * squared);
      sum += w * Eigen::Map<const Vector3f>(&before.data[3 * i]).cwiseQuotient(irradiance_[i]);
      weights += w;
    }
    if (weights == 0) return std::nullopt;
    return (sum / weights).cwiseProduct(irradiance_[cell]).eval();
  }

  /// Cells outside the view take the mean of the nearest cells inside, if any cell was raised.
  void fill_unseen(const capture::Image<float>& before) {
    std::vector<std::size_t> raised;
    for (std::size_t i = 0; i < side_.size(); ++i)
      if (picture_.radiance.data[3 * i] != before.data[3 * i]) raised.push_back(i);
    if (raised.empty() || picture_.seen.empty()) return;
    std::vector<std::size_t> known;
    for (std::size_t i = 0; i < side_.size(); ++i)
      if (seen(i)) known.push_back(i);
    for (std::size_t cell = 0; cell < side_.size(); ++cell) {
      if (seen(cell)) continue;
      const Vector3f here = direction_[cell];
      float best = -1;
      for (const std::size_t i : known) best = std::max(best, here.dot(direction_[i]));
      const float limit = std::cos(std::acos(std::min(best, 1.0f)) + kLightParameters.environment.fill_margin_rad);
      Vector3f sum = Vector3f::Zero();
      float weights = 0;
      for (const std::size_t i : known) {
        if (here.dot(direction_[i]) < limit) continue;
        const float w = environment_solid_angle_sr(static_cast<int>(i) / width_, width_, height_);
        sum += w * Eigen::Map<const Vector3f>(&picture_.radiance.data[3 * i]);
        weights += w;
      }
      if (weights > 0) Eigen::Map<Vector3f>(&picture_.radiance.data[3 * cell]) = sum / weights;
    }
  }

  Illumination& light_;
  EnvironmentMap& picture_;
  const std::vector<PointLight>& lamps_;
  const Enclosure* room_;
  const DistanceField& field_;
  const FieldRays& rays_;
  const MetalMask& metal_;
  int width_, height_;
  std::vector<Vector3f> direction_;   ///< per cell
  std::vector<int> side_;             ///< per cell: index of the measured side that it shows; -1: none
  std::vector<Vector3f> irradiance_;  ///< per cell
  float brightest_ = 0;
};

}  // namespace

void raise_clipped(Illumination& light, const std::vector<PointLight>& lamps, const Enclosure* room,
                   const DistanceField& field, const FieldRays& rays, const MetalMask& metal) {
  if (light.environment.clipped.empty()) return;
  ClippedWalls(light, lamps, room, field, rays, metal).raise();
}

}  // namespace lumigraft::reconstruct
