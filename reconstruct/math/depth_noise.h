#pragma once
// Axial noise of a structured-light depth camera (Nguyen, Izadi & Lovell 2012, "Modeling Kinect Sensor Noise for
// Improved 3D Reconstruction and Tracking").
namespace lumigraft::reconstruct {

/// Coefficients of eq. 2 and 3. The minimum, at 0.4 m and normal incidence, defines a measurement of weight 1.
constexpr double kMinDepthSigma_m = 0.0012;
/// 1σ of depth z, eq. 3; eq. 2 below an incidence of 10°.
double depth_sigma_m(double depth_m, double incidence_rad);
/// The angular term that eq. 3 adds to eq. 2, without its factor 0.0001 / √z.
double oblique_noise(double incidence_rad);
/// Eq. 2: 1σ at normal incidence. `Value` is a float or a vector of floats.
template <typename Value>
[[gnu::always_inline]] inline Value axial_sigma_m(Value depth_m) {
  const Value offset = depth_m - 0.4f;
  return static_cast<float>(kMinDepthSigma_m) + 0.0019f * offset * offset;
}
/// The largest depth at which the noise at normal incidence is at most `sigma_m`; 0 if there is none.
float max_depth_m(float sigma_m);
/// 1σ of inverse depth q (1/m) at normal incidence. `Value` is a float or a vector of floats.
template <typename Value>
[[gnu::always_inline]] inline Value inverse_depth_sigma(Value q) {
  const Value offset = 1 - 0.4f * q;
  return static_cast<float>(kMinDepthSigma_m) * q * q + 0.0019f * offset * offset;
}

}  // namespace lumigraft::reconstruct
