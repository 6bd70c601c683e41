#include "reconstruct/math/triangle.h"

namespace lumigraft::reconstruct {

Eigen::Vector3f nearest_to_origin(const Eigen::Vector3f& a, const Eigen::Vector3f& b, const Eigen::Vector3f& c) {
  const auto on_edge = [](float from, float to) { return from / (from + to); };
  const Eigen::Vector3f ab = b - a, ac = c - a;
  const float ab_a = -ab.dot(a), ac_a = -ac.dot(a);
  if (ab_a <= 0 && ac_a <= 0) return {1, 0, 0};
  const float ab_b = -ab.dot(b), ac_b = -ac.dot(b);
  if (ab_b >= 0 && ac_b <= ab_b) return {0, 1, 0};
  const float region_c = ab_a * ac_b - ab_b * ac_a;
  if (region_c <= 0 && ab_a >= 0 && ab_b <= 0) {
    const float t = on_edge(ab_a, -ab_b);
    return {1 - t, t, 0};
  }
  const float ab_c = -ab.dot(c), ac_c = -ac.dot(c);
  if (ac_c >= 0 && ab_c <= ac_c) return {0, 0, 1};
  const float region_b = ab_c * ac_a - ab_a * ac_c;
  if (region_b <= 0 && ac_a >= 0 && ac_c <= 0) {
    const float t = on_edge(ac_a, -ac_c);
    return {1 - t, 0, t};
  }
  const float region_a = ab_b * ac_c - ab_c * ac_b;
  const float to_c = ac_b - ab_b, to_b = ab_c - ac_c;
  if (region_a <= 0 && to_c >= 0 && to_b >= 0) {
    const float t = on_edge(to_c, to_b);
    return {0, 1 - t, t};
  }
  const float sum = region_a + region_b + region_c;
  return {region_a / sum, region_b / sum, region_c / sum};
}

}  // namespace lumigraft::reconstruct
