#pragma once
// Fast weight functions for filters over pixels, where std::exp and std::pow dominated the cost.

namespace lumigraft::relight {

/// Approximates exp(-x), x >= 0: value and slope exact at 0, 1e-3 at 10.
inline float fast_exp(float x) {
  const float once = 1 / (1 + x / 8), twice = once * once, four = twice * twice;
  return four * four;
}

/// x to the power of 32.
inline float pow32(float x) {
  const float x2 = x * x, x4 = x2 * x2, x8 = x4 * x4, x16 = x8 * x8;
  return x16 * x16;
}

}  // namespace lumigraft::relight
