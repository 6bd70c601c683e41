#include "reconstruct/light/lamp_regions.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <queue>

namespace lumigraft::reconstruct {
namespace {

constexpr float kLargestRegionSr = 0.8f;  // beyond it nothing is compact
constexpr float kLargestGrowth = 0.3f;    // of the solid angle over one octave of threshold, border pixels excepted
constexpr int kThresholdsPerOctave = 4;

template <typename F>
void for_neighbours(std::uint32_t pixel, const FisheyeView& view, int reach, F f) {
  const int x = static_cast<int>(pixel) % view.width, y = static_cast<int>(pixel) / view.width;
  for (int v = std::max(0, y - reach); v <= std::min(view.height - 1, y + reach); ++v) {
    for (int u = std::max(0, x - reach); u <= std::min(view.width - 1, x + reach); ++u) {
      const std::uint32_t other = static_cast<std::uint32_t>(v) * view.width + u;
      if (other != pixel && view.sees(other)) f(other);
    }
  }
}

struct Candidate {
  float level;
  std::uint32_t pixel;
  bool operator<(const Candidate& other) const {
    return level != other.level ? level < other.level : pixel > other.pixel;  // ties by place: deterministic
  }
};

}  // namespace

Pixels stable_region(const std::vector<float>& level, const FisheyeView& view, std::uint32_t peak, float floor) {
  // Flood downhill. `order` lists pixels as they are reached; `threshold` is the lowest level passed so far.
  Pixels order;
  std::vector<float> threshold, area;
  std::vector<bool> queued(level.size(), false);
  std::priority_queue<Candidate> queue;
  queue.push({level[peak], peak});
  queued[peak] = true;
  float lowest = level[peak], total = 0;
  bool whole = true;
  while (!queue.empty()) {
    const Candidate next = queue.top();
    queue.pop();
    if (next.level < floor) break;
    lowest = std::min(lowest, next.level);
    total += view.solid_angle_sr[next.pixel];
    if (total > kLargestRegionSr) {
      whole = false;
      break;
    }
    order.push_back(next.pixel);
    threshold.push_back(lowest);
    area.push_back(total);
    for_neighbours(next.pixel, view, 1, [&](std::uint32_t other) {
      if (queued[other]) return;
      queued[other] = true;
      queue.push({level[other], other});
    });
  }
  // Thresholds below `end` were not flooded to their end.
  const float end = whole ? floor : lowest;
  const auto count_above = [&](float t) {
    return std::partition_point(threshold.begin(), threshold.end(), [&](float x) { return x >= t; }) -
           threshold.begin();
  };
  const float pixel_sr = view.solid_angle_sr[peak];
  std::ptrdiff_t count = 0;
  float largest = 0;  // solid angle that the region may grow to by its blurred edge alone
  for (int step = 1;; ++step) {
    const float t = level[peak] * std::exp2(-static_cast<float>(step) / kThresholdsPerOctave);
    if (t / 2 < end) break;
    const std::ptrdiff_t here = count_above(t), below = count_above(t / 2);
    if (here == 0) continue;
    if (count == 0) {
      // An edge blurred over a pixel moves by less than half a pixel over an octave.
      const float edge = 0.5f * std::sqrt(12.57f * area[here - 1] * pixel_sr);
      if (area[below - 1] > (1 + kLargestGrowth) * area[here - 1] + edge) continue;
      count = below;
      largest = (1 + kLargestGrowth) * area[below - 1] + edge;
    } else if (area[below - 1] <= largest) {
      count = below;  // still the same region: more of its edge. A neighbour that it meets would be more.
    } else {
      break;
    }
  }
  order.resize(count);
  return order;
}

Pixels connected_region(const std::vector<std::uint8_t>& mask, const FisheyeView& view, std::uint32_t seed) {
  Pixels region{seed};
  std::vector<bool> queued(mask.size(), false);
  queued[seed] = true;
  for (std::size_t i = 0; i < region.size(); ++i) {
    for_neighbours(region[i], view, 1, [&](std::uint32_t other) {
      if (queued[other] || !mask[other]) return;
      queued[other] = true;
      region.push_back(other);
    });
  }
  return region;
}

Pixels ring_around(const Pixels& region, const FisheyeView& view, int from_px, int to_px) {
  std::vector<std::uint8_t> depth(view.solid_angle_sr.size(), 0);  // 1 + distance, 0 = not reached
  Pixels front = region, ring;
  for (const std::uint32_t pixel : region) depth[pixel] = 1;
  for (int distance = 1; distance <= to_px; ++distance) {
    Pixels next;
    for (const std::uint32_t pixel : front) {
      for_neighbours(pixel, view, 1, [&](std::uint32_t other) {
        if (depth[other]) return;
        depth[other] = 1;
        next.push_back(other);
      });
    }
    if (distance > from_px) ring.insert(ring.end(), next.begin(), next.end());
    front = std::move(next);
  }
  return ring;
}

float roundness(const Pixels& region, const FisheyeView& view) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  double weight = 0;
  for (const std::uint32_t pixel : region) {
    mean += view.solid_angle_sr[pixel] * view.direction[pixel].cast<double>();
    weight += view.solid_angle_sr[pixel];
  }
  mean /= weight;
  // A pixel's own extent keeps a region of one pixel round.
  Eigen::Matrix3d spread = Eigen::Matrix3d::Identity() * (weight / region.size() / 12);
  for (const std::uint32_t pixel : region) {
    const Eigen::Vector3d d = view.direction[pixel].cast<double>() - mean;
    spread += view.solid_angle_sr[pixel] / weight * d * d.transpose();
  }
  const Eigen::Vector3d widths =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(spread, Eigen::EigenvaluesOnly).eigenvalues();
  return static_cast<float>(std::sqrt(widths[1] / widths[2]));
}

}  // namespace lumigraft::reconstruct
