#include "reconstruct/light/lamp_regions.h"

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
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
  Eigen::AlignedBox2i around;
  const auto at = [&](std::uint32_t pixel) {
    return Eigen::Vector2i(static_cast<int>(pixel) % view.width, static_cast<int>(pixel) / view.width);
  };
  for (const std::uint32_t pixel : region) around.extend(at(pixel));
  const Eigen::Vector2i low = around.min().array() - to_px, size = around.sizes().array() + 2 * to_px + 1;
  std::vector<bool> reached(static_cast<std::size_t>(size.prod()), false);
  const auto reach = [&](std::uint32_t pixel) {
    const Eigen::Vector2i q = at(pixel) - low;
    const auto index = static_cast<std::size_t>(q.y() * size.x() + q.x());
    const bool is_new = !reached[index];
    reached[index] = true;
    return is_new;
  };
  Pixels front = region, ring;
  for (const std::uint32_t pixel : region) reach(pixel);
  for (int distance = 1; distance <= to_px; ++distance) {
    Pixels next;
    for (const std::uint32_t pixel : front) {
      for_neighbours(pixel, view, 1, [&](std::uint32_t other) {
        if (reach(other)) next.push_back(other);
      });
    }
    if (distance > from_px) ring.insert(ring.end(), next.begin(), next.end());
    front = std::move(next);
  }
  return ring;
}

RegionShape shape_of(const Pixels& region, const FisheyeView& view) {
  Eigen::Vector3f centre = Eigen::Vector3f::Zero();
  for (const std::uint32_t pixel : region) centre += view.solid_angle_sr[pixel] * view.direction[pixel];
  centre.normalize();
  const Eigen::Vector3f x = centre.unitOrthogonal(), y = centre.cross(x);
  double area = 0;
  Eigen::Vector2d first = Eigen::Vector2d::Zero();
  Eigen::Matrix2d second = Eigen::Matrix2d::Zero();
  for (const std::uint32_t pixel : region) {
    const Eigen::Vector3f& d = view.direction[pixel];
    const double depth = std::max(d.dot(centre), 0.1f), weight = view.solid_angle_sr[pixel] / (depth * depth * depth);
    const Eigen::Vector2d at = Eigen::Vector2d(d.dot(x), d.dot(y)) / depth;
    area += weight;
    first += weight * at;
    second += weight * at * at.transpose();
  }
  first /= area;
  const double pixel_area = area / static_cast<double>(region.size());
  const Eigen::Matrix2d spread = second / area - first * first.transpose() +
                                 pixel_area / 12 * Eigen::Matrix2d::Identity();  // a pixel's own extent
  const Eigen::Vector2d sides =
      (12 * Eigen::SelfAdjointEigenSolver<Eigen::Matrix2d>(spread, Eigen::EigenvaluesOnly).eigenvalues()).cwiseSqrt();
  const auto outline_px = static_cast<double>(ring_around(region, view, 0, 1).size());
  return {.filled = area / sides.prod(), .outline = outline_px * std::sqrt(pixel_area) / (2 * sides.sum())};
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
