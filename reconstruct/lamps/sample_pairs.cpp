#include "reconstruct/lamps/sample_pairs.h"

#include <algorithm>
#include <random>
#include <utility>

namespace lumigraft::reconstruct {
namespace {

constexpr int kNeighbours = 4;
constexpr int kFar = 6;
constexpr int kFarTries = 40;
constexpr float kFarReach_m = 1.0f;       // a floor's or wall's shading says more the farther it is followed
constexpr float kSameOrientation = 0.9f;  // cosine

}  // namespace

std::vector<SamplePair> choose_pairs(const std::vector<SurfaceSample>& samples) {
  std::vector<int> usable;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    if (samples[i].usable) usable.push_back(static_cast<int>(i));
  }
  std::vector<SamplePair> pairs;
  if (usable.size() < 2) return pairs;
  std::mt19937 random(1);  // the engine's output is the same everywhere; distributions are not
  std::vector<std::pair<float, int>> near(usable.size());
  for (const int a : usable) {
    const SurfaceSample& sample = samples[static_cast<std::size_t>(a)];
    near.clear();
    for (const int b : usable) {
      if (a != b) near.emplace_back((samples[static_cast<std::size_t>(b)].position - sample.position).squaredNorm(), b);
    }
    const auto count = std::min<std::ptrdiff_t>(kNeighbours, static_cast<std::ptrdiff_t>(near.size()));
    std::partial_sort(near.begin(), near.begin() + count, near.end());
    for (std::ptrdiff_t i = 0; i < count; ++i) pairs.push_back({a, near[static_cast<std::size_t>(i)].second});
    for (int found = 0, i = 0; i < kFarTries && found < kFar; ++i) {
      const int b = usable[random() % usable.size()];
      const SurfaceSample& other = samples[static_cast<std::size_t>(b)];
      if (a == b || sample.normal.dot(other.normal) < kSameOrientation) continue;
      if ((sample.position - other.position).squaredNorm() > kFarReach_m * kFarReach_m) continue;
      pairs.push_back({a, b});
      ++found;
    }
  }
  return pairs;
}

}  // namespace lumigraft::reconstruct
