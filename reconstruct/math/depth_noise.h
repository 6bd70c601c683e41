#pragma once
// Unit of the weights of measured depth.

namespace lumigraft::reconstruct {

/// A measurement with this 1σ has weight 1: the least noise of a Kinect for Xbox 360 (capture::DepthNoise).
constexpr double kMinDepthSigma_m = 0.0012;

}  // namespace lumigraft::reconstruct
