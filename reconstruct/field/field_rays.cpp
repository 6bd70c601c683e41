#include "reconstruct/field/field_rays.h"

#include <algorithm>
#include <cmath>

#include "reconstruct/field/parameters.h"
#include "reconstruct/math/simd4.h"

namespace lumigraft::reconstruct {
namespace {

constexpr std::uint8_t kMaxGap = kFieldParameters.max_gap_bricks;

/// Rounds to the nearest integers. The shift keeps coordinates positive: they are within a few thousand voxels.
Eigen::Vector3i nearest_voxel(const Eigen::Vector3f& p) {
  constexpr int kShift = 1 << 13;
  return {static_cast<int>(p.x() + (kShift + 0.5f)) - kShift, static_cast<int>(p.y() + (kShift + 0.5f)) - kShift,
          static_cast<int>(p.z() + (kShift + 0.5f)) - kShift};
}

}  // namespace

FieldRays::FieldRays(const DistanceField& field)
    : voxel_m_(field.voxel_m), coarse_(field.coarse ? std::make_shared<const FieldRays>(*field.coarse) : nullptr) {
  if (field.bricks.empty()) return;
  Eigen::AlignedBox3i box;
  for (const auto& [key, brick] : field.bricks) box.extend(Eigen::Vector3i(key[0], key[1], key[2]));
  low_ = box.min();
  size_ = box.sizes() + Eigen::Vector3i::Ones();
  table_.assign(static_cast<std::size_t>(size_.x()) * size_.y() * size_.z(), nullptr);
  for (const auto& [key, brick] : field.bricks) {
    table_[static_cast<std::size_t>(brick_index(key[0], key[1], key[2]))] = brick.get();
  }
  measure_gaps();
}

void FieldRays::measure_gaps() {
  gap_.assign(table_.size(), kMaxGap);
  for (std::size_t i = 0; i < table_.size(); ++i) {
    if (table_[i]) gap_[i] = 0;
  }
  // In each round the smallest gaps spread by one brick along each axis in turn.
  std::vector<std::uint8_t> spread = gap_, before;
  for (int round = 1; round < kMaxGap; ++round) {
    int stride = 1;
    for (int axis = 0; axis < 3; ++axis) {
      before = spread;
      for (int i = 0; i < static_cast<int>(before.size()); ++i) {
        const int at = i / stride % size_[axis];
        const auto k = static_cast<std::size_t>(i);
        if (at > 0) spread[k] = std::min(spread[k], before[k - static_cast<std::size_t>(stride)]);
        if (at + 1 < size_[axis]) spread[k] = std::min(spread[k], before[k + static_cast<std::size_t>(stride)]);
      }
      stride *= size_[axis];
    }
    for (std::size_t i = 0; i < gap_.size(); ++i) {
      if (gap_[i] == kMaxGap && spread[i] == 0) gap_[i] = static_cast<std::uint8_t>(round);
    }
  }
}

[[gnu::always_inline]] inline std::optional<float> FieldRays::distance_at(const Eigen::Vector3i& voxel) const {
  const int at = brick_index(voxel.x() >> 3, voxel.y() >> 3, voxel.z() >> 3);
  const FieldBrick* brick = at == kOutside ? nullptr : table_[static_cast<std::size_t>(at)];
  if (!brick) return std::nullopt;
  const int index = index_in_brick(voxel);
  if (brick->weight[static_cast<std::size_t>(index)] <= 0) return std::nullopt;
  return brick->distance_m[static_cast<std::size_t>(index)] / voxel_m_;
}

std::optional<float> FieldRays::distance_near(const Eigen::Vector3f& position, const Eigen::Vector3i& voxel,
                                              const FieldBrick& brick) const {
  const auto at = static_cast<std::size_t>(index_in_brick(voxel));
  if (brick.weight[at] <= 0) return std::nullopt;
  const float nearest = brick.distance_m[at] / voxel_m_;
  if (std::abs(nearest) > kFieldParameters.interpolation_reach_voxels) return nearest;
  const Eigen::Vector3i base = nearest_voxel(position - Eigen::Vector3f::Constant(0.5f));
  const Eigen::Vector3f f = position - base.cast<float>();
  const Eigen::Vector3f g = Eigen::Vector3f::Ones() - f;
  const Simd4 low_weights = Simd4{g.x(), f.x(), g.x(), f.x()} * Simd4{g.y(), g.y(), f.y(), f.y()};
  const Simd4 corner_weights[2] = {low_weights * g.z(), low_weights * f.z()};
  float sum = 0, weights = 0;
  const Eigen::Vector3i in_brick = base.unaryExpr([](int i) { return i & (kBrickEdge - 1); });
  if (in_brick.maxCoeff() < kBrickEdge - 1) {
    // All eight are in one brick, the most frequent case; it is `brick`, since the nearest voxel is one of them.
    Simd4 metres{}, known_weights{};
    for (int z = 0; z < 2; ++z) {
      const auto i = static_cast<std::size_t>(index_in_brick(base) + kBrickEdge * kBrickEdge * z), j = i + kBrickEdge;
      const Simd4 known = {brick.weight[i], brick.weight[i + 1], brick.weight[j], brick.weight[j + 1]};
      const Simd4 weight = select(known > 0.0f, corner_weights[z], Simd4{});
      metres +=
          weight * Simd4{brick.distance_m[i], brick.distance_m[i + 1], brick.distance_m[j], brick.distance_m[j + 1]};
      known_weights += weight;
    }
    sum = sum_of(metres) / voxel_m_;
    weights = sum_of(known_weights);
  } else {
    for (int corner = 0; corner < 8; ++corner) {
      const auto distance = distance_at(base + Eigen::Vector3i(corner & 1, (corner >> 1) & 1, corner >> 2));
      if (!distance) continue;
      sum += corner_weights[corner >> 2][corner & 3] * *distance;
      weights += corner_weights[corner >> 2][corner & 3];
    }
  }
  return weights > 0 ? sum / weights : nearest;
}

bool FieldRays::has_brick_at(const Eigen::Vector3f& position_m) const {
  const Eigen::Vector3i voxel = nearest_voxel(position_m / voxel_m_);
  const int brick = brick_index(voxel.x() >> 3, voxel.y() >> 3, voxel.z() >> 3);
  return brick != kOutside && table_[static_cast<std::size_t>(brick)];
}

std::optional<Eigen::Vector3f> FieldRays::first_crossing(const Eigen::Vector3f& from_m,
                                                         const Eigen::Vector3f& direction, float far_m) const {
  const auto crossing = first_own_crossing(from_m, direction, far_m);
  if (!coarse_) return crossing;
  const float end_m = crossing ? (*crossing - from_m).norm() : far_m;
  float past_m = 0;
  while (const auto far = coarse_->first_crossing(from_m + past_m * direction, direction, end_m - past_m)) {
    if (!has_brick_at(*far)) return far;
    past_m = (*far - from_m).norm() + coarse_->voxel_m_;
  }
  return crossing;
}

std::optional<Eigen::Vector3f> FieldRays::first_own_crossing(const Eigen::Vector3f& from_m,
                                                             const Eigen::Vector3f& direction, float far_m) const {
  if (table_.empty()) return std::nullopt;
  const Eigen::Vector3f origin = from_m / voxel_m_;
  const float end = far_m / voxel_m_;
  // Clips the ray to the table.
  float t = 0, leave_table = end;
  for (int axis = 0; axis < 3; ++axis) {
    const float lowest = static_cast<float>(kBrickEdge * low_[axis]) - 0.5f;
    const float highest = static_cast<float>(kBrickEdge * (low_[axis] + size_[axis])) - 0.5f;
    if (direction[axis] == 0) {
      if (origin[axis] < lowest || origin[axis] > highest) return std::nullopt;
      continue;
    }
    const float a = (lowest - origin[axis]) / direction[axis], b = (highest - origin[axis]) / direction[axis];
    t = std::max(t, std::min(a, b));
    leave_table = std::min(leave_table, std::max(a, b));
  }

  enum class In { start, unknown, free, solid } state = In::start;
  float last = 0;  // distance at the previous step, if known
  float last_t = t;
  while (t <= leave_table) {
    const Eigen::Vector3f p = origin + t * direction;
    const Eigen::Vector3i voxel = nearest_voxel(p);
    const Eigen::Vector3i key(voxel.x() >> 3, voxel.y() >> 3, voxel.z() >> 3);
    const int here = brick_index(key.x(), key.y(), key.z());
    const int gap = here == kOutside ? 1 : gap_[static_cast<std::size_t>(here)];
    if (gap > 0) {
      // No bricks here and within gap - 1 bricks around: continue where the ray leaves this block.
      state = In::unknown;
      float leave = end;
      for (int axis = 0; axis < 3; ++axis) {
        if (direction[axis] == 0) continue;
        const float wall = static_cast<float>(kBrickEdge * (key[axis] + (direction[axis] > 0 ? gap : 1 - gap))) - 0.5f;
        leave = std::min(leave, (wall - p[axis]) / direction[axis]);
      }
      t += std::max(leave, 0.0f) + 1e-3f;
      continue;
    }
    const auto distance = distance_near(p, voxel, *table_[static_cast<std::size_t>(here)]);
    if (!distance) {
      state = In::unknown;
      t += kFieldParameters.min_ray_step_voxels;
      continue;
    }
    const bool solid = *distance < 0;
    if ((state == In::free && solid) || (state == In::solid && !solid)) {
      // A distance changes by at most the length of the step. A larger change is not a surface but the border of what
      // the camera observed behind a depth discontinuity.
      if (std::abs(*distance - last) < kFieldParameters.max_distance_slope * (t - last_t)) {
        return (origin + (last_t + last / (last - *distance) * (t - last_t)) * direction) * voxel_m_;
      }
      state = In::start;
    }
    if (state != In::start || !solid) state = solid ? In::solid : In::free;
    last = *distance;
    last_t = t;
    t += std::max(kFieldParameters.min_ray_step_voxels, std::abs(*distance) - 1.0f);
  }
  return std::nullopt;
}

bool FieldRays::free(const Eigen::Vector3f& from_m, const Eigen::Vector3f& to_m) const {
  const Eigen::Vector3f way = to_m - from_m;
  const float length = way.norm();
  return length <= 0 || !first_crossing(from_m, way / length, length);
}

Eigen::Vector3f FieldRays::normal_at(const Eigen::Vector3i& voxel) const {
  for (const int reach : {2, 1}) {
    // Least-squares plane through 27 distances: averages noise better than the difference of two.
    Eigen::Vector3f gradient = Eigen::Vector3f::Zero();
    bool known = true;
    for (int i = 0; i < 27 && known; ++i) {
      const Eigen::Vector3i offset(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1);
      const auto distance = distance_at(voxel + reach * offset);
      known = distance.has_value();
      if (known) gradient += *distance * offset.cast<float>();
    }
    const float length = gradient.norm();
    if (known && length > 0) return gradient / length;
  }
  Eigen::Vector3f gradient = Eigen::Vector3f::Zero();
  const auto here = distance_at(voxel);
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::Vector3i step = Eigen::Vector3i::Unit(axis);
    const auto ahead = distance_at(voxel + step), behind = distance_at(voxel - step);
    if (ahead && behind) {
      gradient[axis] = 0.5f * (*ahead - *behind);
    } else if (here && ahead) {
      gradient[axis] = *ahead - *here;
    } else if (here && behind) {
      gradient[axis] = *here - *behind;
    } else {
      return Eigen::Vector3f::Zero();
    }
  }
  const float length = gradient.norm();
  return length > 0 ? (gradient / length).eval() : gradient;
}

}  // namespace lumigraft::reconstruct
