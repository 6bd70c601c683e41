#include "reconstruct/math/spherical_harmonics.h"

namespace lumigraft::reconstruct {
namespace {

// Normalisation of the bands, Ramamoorthi & Hanrahan 2001, eq. 3.
constexpr float kY0 = 0.28209479f;   // 1/2 sqrt(1/π)
constexpr float kY1 = 0.48860251f;   // 1/2 sqrt(3/π)
constexpr float kY2 = 1.09254843f;   // 1/2 sqrt(15/π)
constexpr float kY20 = 0.31539157f;  // 1/4 sqrt(5/π)
constexpr float kY22 = 0.54627422f;  // 1/4 sqrt(15/π)

// The clamped cosine's coefficients, eq. 8.
constexpr float kPi = 3.14159265f;
constexpr float kA0 = kPi, kA1 = 2 * kPi / 3, kA2 = kPi / 4;

Eigen::Vector3f sum(const Sh9& coefficients, const std::array<float, 9>& basis) {
  Eigen::Vector3f result = Eigen::Vector3f::Zero();
  for (std::size_t i = 0; i < 9; ++i) result += coefficients[i] * basis[i];
  return result;
}

}  // namespace

std::array<float, 9> sh_basis(const Eigen::Vector3f& direction) {
  const float x = direction.x(), y = direction.y(), z = direction.z();
  return {kY0,
          kY1 * y,
          kY1 * z,
          kY1 * x,
          kY2 * x * y,
          kY2 * y * z,
          kY20 * (3 * z * z - 1),
          kY2 * x * z,
          kY22 * (x * x - y * y)};
}

Eigen::Vector3f sh_radiance(const Sh9& radiance, const Eigen::Vector3f& direction) {
  return sum(radiance, sh_basis(direction));
}

Eigen::Vector3f sh_irradiance(const Sh9& radiance, const Eigen::Vector3f& normal) {
  std::array<float, 9> basis = sh_basis(normal);
  for (std::size_t i = 0; i < 9; ++i) basis[i] *= i == 0 ? kA0 : i < 4 ? kA1 : kA2;
  return sum(radiance, basis);
}

}  // namespace lumigraft::reconstruct
