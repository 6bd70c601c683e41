#pragma once
// How far depth is off: the axial noise of a structured-light camera.
namespace lumigraft::reconstruct {

/// Noise of the model at its least, a surface faced squarely at 0.4 m: what a measurement of weight 1 has.
constexpr double kLeastSigmaM = 0.0012;
/// (Nguyen, Izadi & Lovell 2012, eq. 3; its eq. 2 below 10°.)
double depth_sigma_m(double depth_m, double incidence_rad);
/// What eq. 3 adds to eq. 2, over 0.0001 / √depth.
double oblique_noise(double incidence_rad);
/// Of a surface faced squarely, one or several.
template <typename Value>
[[gnu::always_inline]] inline Value straight_sigma_m(Value inverse_depth) {
  const Value away = 1 / inverse_depth - 0.4f;
  return static_cast<float>(kLeastSigmaM) + 0.0019f * away * away;
}
/// Up to where a surface faced squarely is known as well as that; 0 where it nowhere is.
float farthest_m(float sigma_m);
/// σ of inverse depth q, of one or several.
template <typename Value>
[[gnu::always_inline]] inline Value inverse_sigma(Value q) {
  const Value away = 1 - 0.4f * q;
  return static_cast<float>(kLeastSigmaM) * q * q + 0.0019f * away * away;
}

}  // namespace lumigraft::reconstruct
