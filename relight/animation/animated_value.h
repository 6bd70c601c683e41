#pragma once
// Key frames of an animated value, and the value between them (glTF 2.0, appendix C).
#include <Eigen/Geometry>
#include <cstddef>
#include <vector>

namespace lumigraft::relight {

enum class Interpolation { step, linear, cubic_spline };

/// Values of `width` numbers each. The first and the last are held outside the keys' times.
struct AnimatedValue {
  Interpolation interpolation = Interpolation::linear;
  std::size_t width = 1;
  std::vector<float> times_s;  ///< not empty; no key is earlier than the one before
  /// Per key `width` numbers; with cubic splines the tangent before the key, its value and the tangent after it.
  std::vector<float> values;

  /// `width` numbers. Cubic: Hermite's polynomials of value and tangent per second.
  std::vector<float> at(double time_s) const;
  /// Of four numbers, x y z w: a unit quaternion. Linear: along the shorter arc (Shoemake 1985, "Animating Rotation
  /// with Quaternion Curves"); cubic: as the specification says, by components, made unit.
  Eigen::Quaternionf rotation_at(double time_s) const;

 private:
  /// Between which keys a time is; `fraction` is 0 outside of all keys.
  struct Place {
    std::size_t before = 0, after = 0;
    float fraction = 0, span_s = 0;
  };
  Place place(double time_s) const;
  const float* value(std::size_t key) const;
  std::vector<float> spline(const Place& place) const;
};

}  // namespace lumigraft::relight
