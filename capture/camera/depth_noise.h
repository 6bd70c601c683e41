#pragma once
// Noise of depth cameras by the principle by which they measure.
#include <algorithm>
#include <cmath>
#include <numbers>

namespace lumigraft::capture {

/// 1σ of depth z at incidence θ:
///
///   σ(z, θ) = least + curvature (z - nearest)² + oblique z^p θ² / (π/2 - θ)², the last term above 10°
///
/// p: -1/2, or 3/2 with the time of flight. The coefficients are those of a camera of its kind
/// times what `lumigraft calibrate` measured of this one.
struct DepthNoise {
  float least_m = 0.0012f, curvature_per_m = 0.0019f, nearest_m = 0.4f;
  double oblique_m = 0.0001;
  bool oblique_grows = false;  ///< p is 3/2

  /// At normal incidence. `Value` is a float or a vector of floats.
  template <typename Value>
  [[gnu::always_inline]] Value axial_sigma_m(Value depth_m) const {
    const Value offset = depth_m - nearest_m;
    return least_m + curvature_per_m * offset * offset;
  }
  /// Of inverse depth q (1/m) at normal incidence. `Value` is a float or a vector of floats.
  template <typename Value>
  [[gnu::always_inline]] Value inverse_sigma(Value q) const {
    const Value offset = 1 - nearest_m * q;
    return least_m * q * q + curvature_per_m * offset * offset;
  }
  /// θ² / (π/2 - θ)² of the last term.
  static double oblique(double incidence_rad) {
    if (incidence_rad <= std::numbers::pi / 18) return 0;
    const double grazing_rad = std::max(std::numbers::pi / 2 - incidence_rad, 1e-3);
    return incidence_rad * incidence_rad / (grazing_rad * grazing_rad);
  }
  double sigma_m(double depth_m, double incidence_rad) const {
    const double offset = depth_m - double{nearest_m};
    return double{least_m} + double{curvature_per_m} * offset * offset +
           oblique_m * (oblique_grows ? depth_m * std::sqrt(depth_m) : 1 / std::sqrt(depth_m)) * oblique(incidence_rad);
  }
  /// The largest depth at which the noise at normal incidence is at most `sigma_m`; 0 if there is none.
  float max_depth_m(float sigma_m) const {
    const float excess_m = (sigma_m - least_m) / curvature_per_m;
    return excess_m >= 0 ? nearest_m + std::sqrt(excess_m) : 0;
  }
};

enum class DepthPrinciple { structured_light, time_of_flight, stereo };

/// As sessions name it.
inline const char* name_of(DepthPrinciple principle) {
  constexpr const char* kNames[] = {"structured-light", "time-of-flight", "stereo"};
  return kNames[static_cast<int>(principle)];
}

/// A usual camera of this kind, its noise times `scale`:
/// - a pattern of light: Kinect for Xbox 360 (Nguyen, Izadi and Lovell 2012, eq. 2 and 3)
/// - time of flight: Kinect v2 indoors (Fankhauser et al. 2015, "Kinect v2 for mobile robot navigation", section IV)
/// - two cameras: the depth of a disparity with an error of 0.08 pixels, z² · 0.08 px / (focal length · base line),
///   with the 447 px and 50 mm of a RealSense D435 at 848 × 480 (Keselman et al. 2017, "Intel RealSense stereoscopic
///   depth cameras", eq. 1), and 1 mm of the steps in which depth is delivered; oblique as with a pattern of light
inline DepthNoise usual_noise(DepthPrinciple principle, double scale = 1) {
  DepthNoise noise;
  if (principle == DepthPrinciple::time_of_flight) noise = {0.00129167f, 0.0003f, 0.833333f, 0.0001, true};
  if (principle == DepthPrinciple::stereo) noise = {0.001f, 0.0036f, 0, 0.0001, false};
  noise.least_m *= static_cast<float>(scale);
  noise.curvature_per_m *= static_cast<float>(scale);
  noise.oblique_m *= scale;
  return noise;
}

}  // namespace lumigraft::capture
