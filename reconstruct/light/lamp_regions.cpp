#include "reconstruct/light/lamp_regions.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <queue>
#include <utility>

#include "reconstruct/light/parameters.h"

namespace lumigraft::reconstruct {
namespace {

constexpr const LightParameters::Regions& kRegions = kLightParameters.regions;

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
    return level != other.level ? level < other.level
                                : pixel > other.pixel;  // ties by position, for a deterministic order
  }
};

/// Moments of the energy's distribution over directions.
struct Moments {
  double weight = 0;
  Eigen::Vector3d first = Eigen::Vector3d::Zero();
  double second = 0;

  void add(const Eigen::Vector3f& direction, double w) {
    weight += w;
    first += w * direction.cast<double>();
    second += w * direction.squaredNorm();
  }
  /// Σ w |direction - mean|²
  double variance() const { return weight > 0 ? std::max(0.0, second - first.squaredNorm() / weight) : 0; }
};

double weight_of(const PixelEnergy& p) { return p.energy.mean(); }

Moments moments(const std::vector<PixelEnergy>& part, const FisheyeView& view) {
  Moments m;
  for (const PixelEnergy& p : part) m.add(view.direction[p.pixel], weight_of(p));
  return m;
}

Eigen::Vector3f principal_axis(const std::vector<PixelEnergy>& part, const FisheyeView& view) {
  const Moments m = moments(part, view);
  const Eigen::Vector3d mean = m.first / m.weight;
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (const PixelEnergy& p : part) {
    const Eigen::Vector3d d = view.direction[p.pixel].cast<double>() - mean;
    spread += weight_of(p) * d * d.transpose();
  }
  return Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(spread).eigenvectors().col(2).cast<float>();
}

/// Sorts the part along its principal axis; returns the number of pixels before the best cut, 0 if none is better.
std::size_t best_cut(std::vector<PixelEnergy>& part, const FisheyeView& view) {
  const Eigen::Vector3f axis = principal_axis(part, view);
  std::sort(part.begin(), part.end(), [&](const PixelEnergy& a, const PixelEnergy& b) {
    const float da = axis.dot(view.direction[a.pixel]), db = axis.dot(view.direction[b.pixel]);
    return da != db ? da < db : a.pixel < b.pixel;
  });
  const Moments total = moments(part, view);
  Moments low;
  double smallest = total.variance();
  std::size_t cut = 0;
  for (std::size_t i = 0; i + 1 < part.size(); ++i) {
    low.add(view.direction[part[i].pixel], weight_of(part[i]));
    Moments high{
        .weight = total.weight - low.weight, .first = total.first - low.first, .second = total.second - low.second};
    const double sum = low.variance() + high.variance();
    if (sum < smallest) {
      smallest = sum;
      cut = i + 1;
    }
  }
  return cut;
}

}  // namespace

Pixels stable_region(const std::vector<float>& level, const FisheyeView& view, std::uint32_t peak, float floor) {
  // Flood downhill. `order` lists pixels as they are reached, `threshold` the lowest level so far.
  Pixels order;
  std::vector<float> threshold, area;
  std::vector<bool> queued(level.size(), false);
  std::priority_queue<Candidate> queue;
  queue.push({level[peak], peak});
  queued[peak] = true;
  float lowest = level[peak], total = 0;
  bool complete = true;
  while (!queue.empty()) {
    const Candidate next = queue.top();
    queue.pop();
    if (next.level < floor) break;
    lowest = std::min(lowest, next.level);
    total += view.solid_angle_sr[next.pixel];
    if (total > kRegions.max_region_sr) {
      complete = false;
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
  // The flood is incomplete at thresholds below `end`.
  const float end = complete ? floor : lowest;
  const auto count_above = [&](float t) {
    return std::partition_point(threshold.begin(), threshold.end(), [&](float x) { return x >= t; }) -
           threshold.begin();
  };
  const float pixel_sr = view.solid_angle_sr[peak];
  std::ptrdiff_t count = 0;
  float max_area = 0;  // solid angle to which the blurred edge alone may extend the region
  for (int step = 1;; ++step) {
    const float t = level[peak] * std::exp2(-static_cast<float>(step) / kRegions.thresholds_per_octave);
    if (t / 2 < end) break;
    const std::ptrdiff_t here = count_above(t), below = count_above(t / 2);
    if (here == 0) continue;
    if (count == 0) {
      // An edge blurred over a pixel moves by less than half a pixel over an octave.
      const float edge = 0.5f * std::sqrt(12.57f * area[here - 1] * pixel_sr);
      if (area[below - 1] > (1 + kRegions.max_growth) * area[here - 1] + edge) continue;
      count = below;
      max_area = (1 + kRegions.max_growth) * area[below - 1] + edge;
    } else if (area[below - 1] <= max_area) {
      count = below;  // more of the edge of the same region; a merge with a neighbour would add more
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
  // The extent of a pixel makes a region of one pixel round.
  Eigen::Matrix3d spread = Eigen::Matrix3d::Identity() * (weight / region.size() / 12);
  for (const std::uint32_t pixel : region) {
    const Eigen::Vector3d d = view.direction[pixel].cast<double>() - mean;
    spread += view.solid_angle_sr[pixel] / weight * d * d.transpose();
  }
  const Eigen::Vector3d widths =
      Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(spread, Eigen::EigenvaluesOnly).eigenvalues();
  return static_cast<float>(std::sqrt(widths[1] / widths[2]));
}

std::vector<std::vector<PixelEnergy>> variance_cut(std::vector<PixelEnergy> pixels, const FisheyeView& view,
                                                   int parts) {
  std::vector<std::vector<PixelEnergy>> result;
  result.push_back(std::move(pixels));
  while (static_cast<int>(result.size()) < parts) {
    const auto widest = std::max_element(result.begin(), result.end(), [&](const auto& a, const auto& b) {
      return moments(a, view).variance() < moments(b, view).variance();
    });
    const std::size_t cut = best_cut(*widest, view);
    if (cut == 0) break;
    std::vector<PixelEnergy> high(widest->begin() + static_cast<std::ptrdiff_t>(cut), widest->end());
    widest->resize(cut);
    result.push_back(std::move(high));
  }
  return result;
}

}  // namespace lumigraft::reconstruct
