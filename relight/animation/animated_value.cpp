#include "relight/animation/animated_value.h"

#include <algorithm>

namespace lumigraft::relight {

AnimatedValue::Place AnimatedValue::place(double time_s) const {
  const auto after =
      std::upper_bound(times_s.begin(), times_s.end(), time_s, [](double t, float key) { return t < key; });
  const auto last = times_s.size() - 1;
  if (after == times_s.begin()) return {};
  if (after == times_s.end()) return {.before = last, .after = last};
  Place found;
  found.after = static_cast<std::size_t>(after - times_s.begin());
  found.before = found.after - 1;
  const double begin_s = times_s[found.before], span_s = times_s[found.after] - begin_s;  // over 0: `after` is later
  found.span_s = static_cast<float>(span_s);
  found.fraction = static_cast<float>((time_s - begin_s) / span_s);
  return found;
}

const float* AnimatedValue::value(std::size_t key) const {
  return interpolation == Interpolation::cubic_spline ? &values[(3 * key + 1) * width] : &values[key * width];
}

std::vector<float> AnimatedValue::spline(const Place& place) const {
  const float t = place.fraction, t2 = t * t, t3 = t2 * t;
  const float *a = value(place.before), *b = value(place.after);
  const float *leaves_a = a + width, *enters_b = b - width;
  std::vector<float> result(width);
  for (std::size_t i = 0; i < width; ++i) {
    result[i] = (2 * t3 - 3 * t2 + 1) * a[i] + place.span_s * (t3 - 2 * t2 + t) * leaves_a[i] +
                (3 * t2 - 2 * t3) * b[i] + place.span_s * (t3 - t2) * enters_b[i];
  }
  return result;
}

std::vector<float> AnimatedValue::at(double time_s) const {
  const Place found = place(time_s);
  const float *a = value(found.before), *b = value(found.after);
  if (interpolation == Interpolation::step || found.fraction == 0) return {a, a + width};
  if (interpolation == Interpolation::cubic_spline) return spline(found);
  std::vector<float> result(width);
  for (std::size_t i = 0; i < width; ++i) result[i] = a[i] + found.fraction * (b[i] - a[i]);
  return result;
}

Eigen::Quaternionf AnimatedValue::rotation_at(double time_s) const {
  const Place found = place(time_s);
  const Eigen::Quaternionf a(value(found.before)), b(value(found.after));
  if (interpolation == Interpolation::step || found.fraction == 0) return a.normalized();
  if (interpolation == Interpolation::linear) return a.normalized().slerp(found.fraction, b.normalized());
  const std::vector<float> q = spline(found);
  return Eigen::Quaternionf(q.data()).normalized();
}

}  // namespace lumigraft::relight
