#include "reconstruct/light/extrinsics_check.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

namespace lumigraft::reconstruct {
namespace {

using Eigen::Vector3f;

constexpr float kPi = std::numbers::pi_v<float>;
constexpr float kDegree = kPi / 180;
constexpr int kDirections = 5000;     ///< over the sphere
constexpr std::size_t kLeast = 60;    ///< directions that both cameras must know
constexpr float kRoom_m = 10;         ///< longest ray
constexpr float kMargin_deg = 4;      ///< at the end of the fish-eye's view, and around lamps: a cell of its picture
constexpr float kMostOff = 0.5f;      ///< of log radiance: beyond it a direction counts no more
constexpr float kAgrees = 0.05f;      ///< mean of log radiance: as well as they ever agree
constexpr float kLeastShare = 0.6f;   ///< of the directions that both know from the configured pose
constexpr float kFarBetter = 0.5f;    ///< another pose's mean over the configured one's
constexpr float kShiftShare = 0.75f;  ///< a shift's mean over a turn's, to be the likelier error
constexpr float kLeastTurn_deg = 3, kLeastShift_m = 0.05f;  ///< a smaller error is not told from noise

struct Place {
  Eigen::Matrix3f turn = Eigen::Matrix3f::Identity();  ///< what the configured directions are turned by
  Vector3f shift_m = Vector3f::Zero();
};

Vector3f spiral(int i) {  // Fibonacci's
  const float z = 1 - (2 * static_cast<float>(i) + 1) / kDirections, phi = 2.39996323f * static_cast<float>(i);
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
    end_ = std::cos(std::min(kPi, 0.5f * static_cast<float>(camera.model.fov_rad) - kMargin_deg * kDegree));
    look_from(Vector3f::Zero());
  }

  std::optional<ExtrinsicsError> find() {
    const Place configured;
    const auto now = cost(configured);
    if (!now || *now < kAgrees) return std::nullopt;
    // Turns and shifts look alike near by: downhill from the best turn and from where it is said to stand, and from the
    // best shift, which must explain much more to be believed.
    Place best = coarse_turn(*now), near, shifted = coarse_shift(*now);
    float least = refine(best);
    const auto take = [&](Place& place, float share) {
      const float here = refine(place);
      if (here >= share * least) return;
      least = here;
      best = place;
    };
    take(near, 1);
    take(shifted, kShiftShare);
    const double turn = Eigen::AngleAxisf(best.turn).angle() / kDegree, shift = best.shift_m.norm();
    const bool differs = turn > kLeastTurn_deg || shift > kLeastShift_m;
    return least < kFarBetter * *now && differs ? std::optional(ExtrinsicsError{turn, shift}) : std::nullopt;
  }

 private:
  struct Known {
    Vector3f direction;
    float log_radiance;
  };

  /// What the field shows from there.
  void look_from(const Vector3f& shift_m) {
    if (looked_ && shift_m == shift_m_) return;
    looked_ = true;
    shift_m_ = shift_m;
    known_.clear();
    const Vector3f from = light_.probe_position_m + shift_m;
    for (int i = 0; i < kDirections; ++i) {
      const Vector3f direction = spiral(i);
      const auto hit = rays_.first_crossing(from, direction, kRoom_m);
      const auto radiance = hit ? field_.radiance(*hit) : std::nullopt;
      if (!radiance || !(radiance->mean() > 0) || metal_.contains(*hit)) continue;
      known_.push_back({direction, std::log(radiance->mean())});
    }
  }

  bool usable(const Vector3f& direction) const {
    if (direction.dot(axis_) < end_) return false;
    return std::none_of(light_.lights.begin(), light_.lights.end(), [&](const PointLight& lamp) {
      return direction.dot(lamp.direction) > std::cos(1.5f * lamp.angular_radius_rad + kMargin_deg * kDegree);
    });
  }

  /// Mean difference of log radiance up to one factor; empty where too few directions are known to both.
  std::optional<float> cost(const Place& place) {
    look_from(place.shift_m);
    off_.clear();
    for (const Known& known : known_) {
      const Vector3f seen_at = place.turn.transpose() * known.direction;
      if (!usable(seen_at)) continue;
      off_.push_back(std::log(std::max(light_.environment.sample(seen_at).mean(), 1e-6f)) - known.log_radiance);
    }
    if (first_seen_ == 0) first_seen_ = off_.size();
    if (off_.size() < kLeast || static_cast<float>(off_.size()) < kLeastShare * static_cast<float>(first_seen_)) {
      return std::nullopt;
    }
    const auto middle = off_.begin() + static_cast<std::ptrdiff_t>(off_.size() / 2);
    std::nth_element(off_.begin(), middle, off_.end());
    const float factor = *middle;
    float sum = 0;
    for (const float off : off_) sum += std::min(std::abs(off - factor), kMostOff);
    return sum / static_cast<float>(off_.size());
  }
  /// The best turn of all, in steps of ten degrees about the axis and up to thirty across it.
  Place coarse_turn(float least) {
    Place best;
    const Vector3f x = axis_.unitOrthogonal();
    for (int tilt = 0; tilt <= 3; ++tilt) {
      for (int side = 0; side < (tilt == 0 ? 1 : 8); ++side) {
        const Eigen::Matrix3f across =
            turned(turned(axis_, 45 * static_cast<float>(side)) * x, 10 * static_cast<float>(tilt));
        for (int about = 0; about < 36; ++about) {
          const Place place{across * turned(axis_, 10 * static_cast<float>(about)), Vector3f::Zero()};
          const auto here = cost(place);
          if (!here || *here >= least) continue;
          least = *here;
          best = place;
        }
      }
    }
    return best;
  }

  /// The best shift along the tag's plane and up and down, of ten and twenty centimetres.
  Place coarse_shift(float least) {
    Place best;
    for (const float metres : {0.1f, 0.2f}) {
      for (int i = 0; i < 10; ++i) {
        const float angle = static_cast<float>(i) * kPi / 4;
        const Vector3f along = i < 8 ? Vector3f(std::cos(angle), std::sin(angle), 0) : Vector3f(0, 0, i == 8 ? 1 : -1);
        const Place place{Eigen::Matrix3f::Identity(), metres * along};
        const auto here = cost(place);
        if (!here || *here >= least) continue;
        least = *here;
        best = place;
      }
    }
    return best;
  }

  /// Downhill in turns and shifts, in falling steps.
  float refine(Place& place) {
    float least = cost(place).value_or(kMostOff);
    for (int level = 0; level < 4; ++level) {
      const float degrees = 5 / static_cast<float>(1 << level), metres = 0.08f / static_cast<float>(1 << level);
      for (int round = 0; round < 4; ++round) {
        const float before = least;
        for (int i = 0; i < 12; ++i) {
          const float sign = i % 2 ? -1.0f : 1.0f;
          const Vector3f axis = Vector3f::Unit(i / 2 % 3);
          Place next = place;
          if (i < 6) {
            next.turn = turned(axis, sign * degrees) * next.turn;
          } else {
            next.shift_m += sign * metres * axis;
          }
          const auto here = cost(next);
          if (!here || *here >= least) continue;
          least = *here;
          place = next;
        }
        if (least > 0.99f * before) break;
      }
    }
    return least;
  }

  const DistanceField& field_;
  const FieldRays& rays_;
  const MetalMask& metal_;
  const Illumination& light_;
  Vector3f axis_;
  float end_;
  bool looked_ = false;
  Vector3f shift_m_ = Vector3f::Zero();
  std::vector<Known> known_;
  std::vector<float> off_;
  std::size_t first_seen_ = 0;  ///< directions known to both from the configured pose
};

}  // namespace

std::optional<ExtrinsicsError> rig_error(const DistanceField& field, const FieldRays& rays, const MetalMask& metal,
                                         const Illumination& illumination, const capture::FisheyeCamera& camera) {
  return ExtrinsicsCheck(field, rays, metal, illumination, camera).find();
}

}  // namespace lumigraft::reconstruct
