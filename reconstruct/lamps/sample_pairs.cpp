#include "reconstruct/lamps/sample_pairs.h"

#include <algorithm>
#include <random>
#include <utility>

#include "reconstruct/lamps/parameters.h"

namespace lumigraft::reconstruct {
namespace {

constexpr const LampParameters::Pairs& kPairs = kLampParameters.pairs;

}  // namespace

std::vector<SamplePair> choose_pairs(const std::vector<SurfaceSample>& samples) {
  std::vector<int> usable;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    if (samples[i].usable) usable.push_back(static_cast<int>(i));
  }
  std::vector<SamplePair> pairs;
  if (usable.size() < 2) return pairs;
  std::mt19937 random(1);  // engines are portable, distributions are not
  std::vector<std::pair<float, int>> near(usable.size());
  for (const int a : usable) {
    const SurfaceSample& sample = samples[static_cast<std::size_t>(a)];
    near.clear();
    for (const int b : usable) {
      if (a != b) near.emplace_back((samples[static_cast<std::size_t>(b)].position - sample.position).squaredNorm(), b);
    }
    const auto count = std::min<std::ptrdiff_t>(kPairs.neighbours, static_cast<std::ptrdiff_t>(near.size()));
    std::partial_sort(near.begin(), near.begin() + count, near.end());
    const auto add = [&](int b) {
      const SurfaceSample& other = samples[static_cast<std::size_t>(b)];
      const float touching_m = kPairs.touching_cells * std::min(sample.size_m, other.size_m);
      const bool adjacent = (sample.position - other.position).norm() < touching_m &&
                            sample.normal.dot(other.normal) > kPairs.same_orientation;
      if (sample.known.sigma < 0 || other.known.sigma < 0) pairs.push_back({.a = a, .b = b, .adjacent = adjacent});
    };
    for (std::ptrdiff_t i = 0; i < count; ++i) add(near[static_cast<std::size_t>(i)].second);
    for (int found = 0, i = 0; i < kPairs.far_tries && found < kPairs.far; ++i) {
      const int b = usable[random() % usable.size()];
      const SurfaceSample& other = samples[static_cast<std::size_t>(b)];
      if (a == b || sample.normal.dot(other.normal) < kPairs.same_orientation) continue;
      if ((sample.position - other.position).squaredNorm() > kPairs.far_reach_m * kPairs.far_reach_m) continue;
      add(b);
      ++found;
    }
  }
  return pairs;
}

}  // namespace lumigraft::reconstruct
