#pragma once
// Real spherical harmonics of order 2 (bands 0, 1, 2: nine coefficients) in the tag frame.
//
// Basis and signs as in Ramamoorthi & Hanrahan 2001 ("An Efficient Representation for Irradiance Environment Maps"),
// eq. 3, ordered Y00, Y1-1 (y), Y10 (z), Y11 (x), Y2-2 (xy), Y2-1 (yz), Y20 (3z²-1), Y21 (xz), Y22 (x²-y²), all with
// positive sign.
#include <Eigen/Core>
#include <array>

namespace lumigraft::reconstruct {

using Sh9 = std::array<Eigen::Vector3f, 9>;  ///< RGB per coefficient

inline Sh9 zero_sh() {
  Sh9 zero;
  zero.fill(Eigen::Vector3f::Zero());  // Sh9{} leaves them uninitialized
  return zero;
}

std::array<float, 9> sh_basis(const Eigen::Vector3f& direction);
/// Radiance that arrives from `direction` (unit).
Eigen::Vector3f sh_radiance(const Sh9& radiance, const Eigen::Vector3f& direction);
/// Irradiance on a plane with unit normal `normal`: convolution with the clamped cosine, eq. 7 and 8 (A0 = π,
/// A1 = 2π/3, A2 = π/4).
Eigen::Vector3f sh_irradiance(const Sh9& radiance, const Eigen::Vector3f& normal);

}  // namespace lumigraft::reconstruct
