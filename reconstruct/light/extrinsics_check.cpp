#include "reconstruct/light/extrinsics_check.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <numbers>
#include <vector>

#include "reconstruct/light/parameters.h"
#include "reconstruct/math/median.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Vector3f;

constexpr const LightParameters::ExtrinsicsCheck& kExtrinsicsCheck = kLightParameters.extrinsics_check;

struct PoseOffset {
  Eigen::Matrix3f turn = Eigen::Matrix3f::Identity();  ///< of the configured directions
  Vector3f shift_m = Vector3f::Zero();
};

/// Fibonacci spiral on the sphere.
Vector3f spiral(int i) {
  const float z = 1 - (2 * static_cast<float>(i) + 1) / kExtrinsicsCheck.directions,
              phi = 2.39996323f * static_cast<float>(i);
  const float r = std::sqrt(1 - z * z);
  return {r * std::cos(phi), r * std::sin(phi), z};
}

Eigen::Matrix3f turned(const Vector3f& axis, float degrees) {
  return Eigen::AngleAxisf(degrees * kDegree, axis).toRotationMatrix();
}

class ExtrinsicsCheck {
 public:
  ExtrinsicsCheck(const DistanceField& field, const FieldRays& rays, const MetalMask& metal, const Illumination& light,
                  const capture::FisheyeCamera& camera)
      : field_(field), rays_(rays), metal_(metal), light_(light) {
    axis_ = camera.T_tag_fisheye.linear().cast<float>().col(2);
    end_ = std::cos(std::min(std::numbers::pi_v<float>,
                             0.5f * static_cast<float>(camera.model.fov_rad) - kExtrinsicsCheck.margin_deg * kDegree));
  }

  std::optional<ExtrinsicsError> find() {
    const PoseOffset configured;
    const auto now = cost(configured);
    if (!now || *now < kExtrinsicsCheck.agreement) return std::nullopt;
    // Turns and shifts look alike: a shift must explain much more than the best turn alone to be accepted.
    PoseOffset best;
    float min_cost = *now;
    for (PoseOffset offset : coarse_turns()) {
      const float here = refine(offset, false);
      if (here >= min_cost) continue;
      min_cost = here;
      best = offset;
    }
    for (PoseOffset offset : {best, configured, coarse_shift(*now)}) {
      const float here = refine(offset, true);
      if (here >= kExtrinsicsCheck.shift_over_turn * min_cost) continue;
      min_cost = here;
      best = offset;
    }
    const double turn = Eigen::AngleAxisf(best.turn).angle() / kDegree, shift = best.shift_m.norm();
    const bool differs = turn > kExtrinsicsCheck.min_turn_deg || shift > kExtrinsicsCheck.min_shift_m;
    const bool better = min_cost < kExtrinsicsCheck.min_improvement * *now && significant(*now, min_cost);
    return better && differs ? std::optional(ExtrinsicsError{turn, shift}) : std::nullopt;
  }

 private:
  struct FieldSample {
    Vector3f direction;
    float log_radiance;
  };

  /// Whether the six numbers of another pose would hardly lower the cost as much by chance: the likelihood ratio for
  /// errors of the density exp(-|e| / cost), where correct rigs have an error, too.
  bool significant(float cost_now, float cost_then) const {
    const float observations = static_cast<float>(first_common_) / kExtrinsicsCheck.directions_per_observation;
    const float floor = 0.5f * kExtrinsicsCheck.agreement;
    return 2 * observations * std::log((cost_now + floor) / (cost_then + floor)) >
           kExtrinsicsCheck.min_likelihood_ratio;
  }

  /// The field's radiance as seen from the shifted probe. Searches from several starts come to the same shifts.
  const std::vector<FieldSample>& sample_field(const Vector3f& shift_m) {
    const auto [at, is_new] = sampled_.try_emplace({shift_m.x(), shift_m.y(), shift_m.z()});
    if (!is_new) return at->second;
    const Vector3f from = light_.probe_position_m + shift_m;
    for (int i = 0; i < kExtrinsicsCheck.directions; ++i) {
      const Vector3f direction = spiral(i);
      const auto here = log_radiance(from, direction);
      if (here && even_around(from, direction, *here)) at->second.push_back({direction, *here});
    }
    return at->second;
  }

  std::optional<float> log_radiance(const Vector3f& from, const Vector3f& direction) const {
    const auto hit = rays_.first_crossing(from, direction, kExtrinsicsCheck.max_ray_m);
    const auto radiance = hit ? field_.radiance(*hit) : std::nullopt;
    if (!radiance || !(radiance->mean() > 0) || metal_.contains(*hit)) return std::nullopt;
    return std::log(radiance->mean());
  }

  /// A cell of the environment mixes what lies within it: an edge says nothing.
  bool even_around(const Vector3f& from, const Vector3f& direction, float log_here) const {
    const Vector3f s = kExtrinsicsCheck.cell_rad * direction.unitOrthogonal(), t = direction.cross(s);
    for (const Vector3f& side : {s, t, Vector3f(-s), Vector3f(-t)}) {
      const auto beside = log_radiance(from, (direction + side).normalized());
      if (!beside || std::abs(*beside - log_here) > kExtrinsicsCheck.max_unevenness) return false;
    }
    return true;
  }

  bool usable(const Vector3f& direction) const {
    if (direction.dot(axis_) < end_) return false;
    return std::none_of(light_.lights.begin(), light_.lights.end(), [&](const PointLight& lamp) {
      return direction.dot(lamp.direction) >
             std::cos(1.5f * lamp.angular_radius_rad + kExtrinsicsCheck.margin_deg * kDegree);
    });
  }

  /// Mean difference of log radiance up to one factor; empty where too few directions are known to both.
  std::optional<float> cost(const PoseOffset& offset) {
    differences_.clear();
    for (const FieldSample& known : sample_field(offset.shift_m)) {
      const Vector3f seen_at = offset.turn.transpose() * known.direction;
      if (!usable(seen_at)) continue;
      differences_.push_back(std::log(std::max(light_.environment.sample(seen_at).mean(), 1e-6f)) - known.log_radiance);
    }
    if (first_common_ == 0) first_common_ = differences_.size();
    if (differences_.size() < kExtrinsicsCheck.min_directions ||
        static_cast<float>(differences_.size()) <
            kExtrinsicsCheck.min_common_fraction * static_cast<float>(first_common_)) {
      return std::nullopt;
    }
    const float factor = median(differences_);
    float sum = 0;
    for (const float value : differences_)
      sum += std::min(std::abs(value - factor), kExtrinsicsCheck.max_log_difference);
    return sum / static_cast<float>(differences_.size());
  }

  /// Whether the cost is less than `min_cost`, which it then becomes.
  bool improves(const PoseOffset& offset, float& min_cost) {
    const auto here = cost(offset);
    if (!here || *here >= min_cost) return false;
    min_cost = *here;
    return true;
  }

  /// The best turns that differ much, in steps of 10°: all turns about the optical axis, and tilts of it up to 30°.
  std::vector<PoseOffset> coarse_turns() {
    std::vector<std::pair<float, PoseOffset>> turns;
    const Vector3f x = axis_.unitOrthogonal();
    for (int tilt = 0; tilt <= 3; ++tilt) {
      for (int side = 0; side < (tilt == 0 ? 1 : 8); ++side) {
        const Eigen::Matrix3f across =
            turned(turned(axis_, 45 * static_cast<float>(side)) * x, 10 * static_cast<float>(tilt));
        for (int about = 0; about < 36; ++about) {
          const PoseOffset offset{across * turned(axis_, 10 * static_cast<float>(about)), Vector3f::Zero()};
          if (const auto here = cost(offset)) turns.emplace_back(*here, offset);
        }
      }
    }
    std::sort(turns.begin(), turns.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
    std::vector<PoseOffset> result;
    for (const auto& turn : turns) {
      const PoseOffset& offset = turn.second;
      const auto is_near = [&](const PoseOffset& other) {
        return Eigen::AngleAxisf(other.turn.transpose() * offset.turn).angle() <
               kExtrinsicsCheck.start_separation_deg * kDegree;
      };
      if (std::none_of(result.begin(), result.end(), is_near)) result.push_back(offset);
      if (result.size() == kExtrinsicsCheck.starts) break;
    }
    return result;
  }

  /// The best shift of 0.1 and 0.2 m in the tag's plane and along its normal.
  PoseOffset coarse_shift(float min_cost) {
    PoseOffset best;
    for (const float metres : {0.1f, 0.2f}) {
      for (int i = 0; i < 10; ++i) {
        const float angle = static_cast<float>(i) * std::numbers::pi_v<float> / 4;
        const Vector3f along = i < 8 ? Vector3f(std::cos(angle), std::sin(angle), 0) : Vector3f(0, 0, i == 8 ? 1 : -1);
        const PoseOffset offset{Eigen::Matrix3f::Identity(), metres * along};
        if (improves(offset, min_cost)) best = offset;
      }
    }
    return best;
  }

  /// Pattern search over turns, and shifts on request, with steps that are halved.
  float refine(PoseOffset& offset, bool shifts) {
    float min_cost = cost(offset).value_or(kExtrinsicsCheck.max_log_difference);
    for (int level = 0; level < kExtrinsicsCheck.refine_levels; ++level) {
      const float scale = static_cast<float>(1 << level), degrees = kExtrinsicsCheck.first_turn_deg / scale,
                  metres = kExtrinsicsCheck.first_shift_m / scale;
      for (int round = 0; round < kExtrinsicsCheck.rounds_per_level; ++round) {
        const float before = min_cost;
        for (int i = 0; i < (shifts ? 12 : 6); ++i) {
          const float sign = i % 2 ? -1.0f : 1.0f;
          const Vector3f axis = Vector3f::Unit(i / 2 % 3);
          PoseOffset next = offset;
          if (i < 6) {
            next.turn = turned(axis, sign * degrees) * next.turn;
          } else {
            next.shift_m += sign * metres * axis;
          }
          if (improves(next, min_cost)) offset = next;
        }
        if (min_cost > 0.99f * before) break;
      }
    }
    return min_cost;
  }

  const DistanceField& field_;
  const FieldRays& rays_;
  const MetalMask& metal_;
  const Illumination& light_;
  Vector3f axis_;
  float end_;
  std::map<std::array<float, 3>, std::vector<FieldSample>> sampled_;  ///< by shift
  std::vector<float> differences_;
  std::size_t first_common_ = 0;  ///< directions measured by both at the configured pose
};

}  // namespace

std::optional<ExtrinsicsError> extrinsics_error(const DistanceField& field, const FieldRays& rays,
                                                const MetalMask& metal, const Illumination& illumination,
                                                const capture::FisheyeCamera& camera) {
  return ExtrinsicsCheck(field, rays, metal, illumination, camera).find();
}

}  // namespace lumigraft::reconstruct
