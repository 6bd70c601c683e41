#include "relight/tracing/photon_map.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "relight/tracing/parallel_for.h"
#include "relight/tracing/parameters.h"

namespace lumigraft::relight {

using Eigen::Vector3f;

PhotonMap::PhotonMap(std::vector<Photon> photons) : photons_(std::move(photons)) {
  if (photons_.empty()) return;
  radii2_m2_.assign(photons_.size(), 0);
  divide(0, static_cast<std::uint32_t>(photons_.size()));
  bound(0);
  std::vector<float> found(photons_.size());
  for_each_index(photons_.size(), kTracing.photon_block,
                 [&](std::size_t i) { found[i] = neighbour2_m2(static_cast<std::uint32_t>(i)); });
  radii2_m2_ = std::move(found);
  bound(0);
}

/// Returns the node of these photons, which it sorts.
std::uint32_t PhotonMap::divide(std::uint32_t first, std::uint32_t count) {
  const auto node = static_cast<std::uint32_t>(nodes_.size());
  nodes_.push_back({.first = first, .second = 0, .count = count});
  if (count <= static_cast<std::uint32_t>(kTracing.photons_per_leaf)) return node;
  Eigen::AlignedBox3f box;
  for (std::uint32_t i = first; i < first + count; ++i) box.extend(photons_[i].position_m);
  Eigen::Index axis = 0;
  box.sizes().maxCoeff(&axis);
  const auto begin = photons_.begin() + first;
  const std::uint32_t half = count / 2;
  std::nth_element(begin, begin + half, begin + count,
                   [axis](const Photon& a, const Photon& b) { return a.position_m[axis] < b.position_m[axis]; });
  const std::uint32_t left = divide(first, half), right = divide(first + half, count - half);
  nodes_[node].first = left;
  nodes_[node].second = right;
  return node;
}

void PhotonMap::bound(std::uint32_t index) {
  Node& node = nodes_[index];
  node.low_m.setConstant(std::numeric_limits<float>::infinity());
  node.high_m = -node.low_m;
  const auto extend = [&node](const Vector3f& low_m, const Vector3f& high_m) {
    node.low_m = node.low_m.cwiseMin(low_m);
    node.high_m = node.high_m.cwiseMax(high_m);
  };
  if (node.second != 0) {
    for (const std::uint32_t child : {node.first, node.second}) {
      bound(child);
      extend(nodes_[child].low_m, nodes_[child].high_m);
    }
    return;
  }
  for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
    const Vector3f reach = Vector3f::Constant(std::sqrt(radii2_m2_[i]));
    extend(photons_[i].position_m - reach, photons_[i].position_m + reach);
  }
}

/// Squared distance to the k-th neighbour, or the last.
float PhotonMap::neighbour2_m2(std::uint32_t photon) const {
  const Vector3f& p_m = photons_[photon].position_m;
  const auto wanted = static_cast<std::size_t>(kTracing.photon_neighbours);
  std::vector<float> nearest2;  // a heap, the farthest first
  nearest2.reserve(wanted + 1);
  const auto distance2 = [&](const Node& node) {
    return (p_m - p_m.cwiseMax(node.low_m).cwiseMin(node.high_m)).squaredNorm();
  };
  std::array<std::pair<float, std::uint32_t>, kMaxDepth> stack;
  std::size_t size = 0;
  stack[size++] = {0.0f, 0u};
  while (size > 0) {
    const auto [far2, index] = stack[--size];
    if (nearest2.size() == wanted && far2 >= nearest2.front()) continue;
    const Node& node = nodes_[index];
    if (node.second != 0) {
      const float first2 = distance2(nodes_[node.first]), second2 = distance2(nodes_[node.second]);
      const bool swap = first2 < second2;  // the nearer one is visited first
      stack[size++] = {swap ? second2 : first2, swap ? node.second : node.first};
      stack[size++] = {swap ? first2 : second2, swap ? node.first : node.second};
      continue;
    }
    for (std::uint32_t i = node.first; i < node.first + node.count; ++i) {
      const float d2 = (photons_[i].position_m - p_m).squaredNorm();
      if (i == photon || (nearest2.size() == wanted && d2 >= nearest2.front())) continue;
      nearest2.push_back(d2);
      std::ranges::push_heap(nearest2);
      if (nearest2.size() <= wanted) continue;
      std::ranges::pop_heap(nearest2);
      nearest2.pop_back();
    }
  }
  const float min2 = kTracing.min_photon_radius_m * kTracing.min_photon_radius_m;
  return nearest2.empty() ? min2 : std::max(nearest2.front(), min2);
}

}  // namespace lumigraft::relight
