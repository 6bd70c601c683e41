#pragma once
// How the colour camera's radiance differs from the fish-eye's: white balance, level and vignetting that the session
// does not state, from the places that both cameras see. A diffuse place sends both the same radiance:
//
//   log L_color - log L_fisheye = log g_c - (k₁ x + k₂ x²),  x = (θ / θ_corner)²
//
// with g a gain per channel and θ the angle to the colour camera's optical axis. Solved by iteratively reweighted least
// squares with a Geman-McClure loss whose scale shrinks (graduated non-convexity, Blake and Zisserman 1987): gloss, and
// what stands between a place and the fish-eye, are outliers.
#include <Eigen/Core>
#include <optional>
#include <vector>

#include "reconstruct/light/light.h"

namespace lumigraft::reconstruct {

/// A place that the colour camera sees.
struct ColorPlace {
  Eigen::Vector3f position_m, normal;  ///< tag frame; the normal of the side that the camera sees
  Eigen::Array3f radiance;             ///< W/sr/m²
  float corner;                        ///< (θ / θ_corner)²: 0 on the optical axis, 1 in the corners of the image
};

struct CameraMatch {
  Eigen::Array3f log_gain = Eigen::Array3f::Zero();
  float level_sigma = 0;                            ///< 1σ of the mean of log_gain
  float hue_sigma = 0;                              ///< 1σ of a channel's deviation from the mean
  Eigen::Array2f falloff = Eigen::Array2f::Zero();  ///< k₁, k₂
  float falloff_sigma = 0;                          ///< 1σ of k₁ + k₂, the log loss in the corners
};

/// `surface_m`: all points of the colour camera's depth, tag frame; they hide places behind them from the fish-eye. So
/// does a thin board the place on its other side.
/// Without `with_falloff` vignetting is zero. Empty if both cameras see too few places in common or disagree about most
/// of them.
std::optional<CameraMatch> match_cameras(const std::vector<ColorPlace>& places,
                                         const std::vector<Eigen::Vector3f>& surface_m, const Illumination& light,
                                         bool with_falloff);

}  // namespace lumigraft::reconstruct
