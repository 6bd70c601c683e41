#include "reconstruct/light/lamp_shadows.h"

#include <algorithm>
#include <cmath>

namespace lumigraft::reconstruct {

std::optional<Eigen::Vector3f> LampProjection::operator()(const Eigen::Vector3f& p_m) const {
  constexpr float kMaxSlope = 3;  // beyond it cells become as long as they are wide
  const Eigen::Vector3f at = axes * (p_m - origin_m);
  if (far) return at;
  if (!(at.z() > 0) || std::max(std::abs(at.x()), std::abs(at.y())) > kMaxSlope * at.z()) return std::nullopt;
  return Eigen::Vector3f(at.x() / at.z(), at.y() / at.z(), at.z());
}

float LampShadow::open_at(const Eigen::Vector3f& p_m) const {
  const std::optional<Eigen::Vector3f> at = projection(p_m);
  if (!at || !(at->head<2>() - min).allFinite()) return 1;
  // Far outside, so that cells can be counted.
  if (((at->head<2>() - min).array().abs() > 2 * cell * static_cast<float>(std::max(open.width, open.height))).any())
    return 1;
  const float x = (at->x() - min.x()) / cell, y = (at->y() - min.y()) / cell;
  const int u = static_cast<int>(std::floor(x)), v = static_cast<int>(std::floor(y));
  const float a = x - std::floor(x), b = y - std::floor(y);
  const auto value = [&](int i, int j) {
    return i < 0 || j < 0 || i >= open.width || j >= open.height ? 1 : open.at(i, j);
  };
  return (1 - b) * ((1 - a) * value(u, v) + a * value(u + 1, v)) +
         b * ((1 - a) * value(u, v + 1) + a * value(u + 1, v + 1));
}

const LampShadow* LampShadows::of(int lamp) const {
  const auto found = std::find_if(lamps.begin(), lamps.end(), [&](const LampShadow& s) { return s.lamp == lamp; });
  return found == lamps.end() ? nullptr : &*found;
}

}  // namespace lumigraft::reconstruct
