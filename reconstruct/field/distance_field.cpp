#include "reconstruct/field/distance_field.h"

#include <algorithm>
#include <cmath>

namespace lumigraft::reconstruct {
namespace {

/// Floor. std::floor is a library call without SSE 4.1, which baseline x86-64 lacks.
int rounded_down(float x) {
  const int toward_zero = static_cast<int>(x);
  return toward_zero - (x < static_cast<float>(toward_zero) ? 1 : 0);
}
Eigen::Vector3i rounded_down(const Eigen::Vector3f& p) {
  return {rounded_down(p.x()), rounded_down(p.y()), rounded_down(p.z())};
}

/// The eight voxels around a point, and the position of the point between them.
struct Cell {
  std::array<const FieldBrick*, 8> bricks{};  ///< per corner; bit 0 = +x, bit 1 = +y, bit 2 = +z
  std::array<int, 8> index{};
  Eigen::Vector3f fraction;

  float corner_weight(int corner) const {
    return ((corner & 1) ? fraction.x() : 1 - fraction.x()) * ((corner & 2) ? fraction.y() : 1 - fraction.y()) *
           ((corner & 4) ? fraction.z() : 1 - fraction.z());
  }
};

/// Looks up cells along a path. Caches the current brick and its seven neighbours towards +x, +y, +z, so that steps
/// within one brick need no hash look-up.
class Reader {
 public:
  explicit Reader(const DistanceField& field) : field_(field) {}

  /// False if the brick of the cell's lowest corner does not exist: the cell is unknown. Other corners may be null.
  bool find(const Eigen::Vector3f& position_voxels, Cell& cell) {
    const Eigen::Vector3i voxel = rounded_down(position_voxels);
    const BrickKey key = brick_of(voxel);
    if (!has_key_ || key != key_) {
      key_ = key;
      has_key_ = true;
      looked_up_.fill(false);
    }
    if (!neighbour(0)) return false;
    cell.fraction = position_voxels - voxel.cast<float>();
    const int x = voxel.x() & 7, y = voxel.y() & 7, z = voxel.z() & 7;
    for (int corner = 0; corner < 8; ++corner) {
      const int cx = x + (corner & 1), cy = y + ((corner >> 1) & 1), cz = z + (corner >> 2);
      cell.bricks[corner] = neighbour((cx >> 3) | ((cy >> 3) << 1) | ((cz >> 3) << 2));
      cell.index[corner] = index_in_brick({cx, cy, cz});
    }
    return true;
  }

  std::optional<FieldSample> sample(const Eigen::Vector3f& position_voxels) {
    Cell cell;
    if (!find(position_voxels, cell)) return std::nullopt;
    FieldSample result;
    for (int corner = 0; corner < 8; ++corner) {
      if (!cell.bricks[corner]) return std::nullopt;
      const float weight = cell.bricks[corner]->weight[cell.index[corner]];
      if (weight <= 0) return std::nullopt;
      const float corner_weight = cell.corner_weight(corner);
      result.distance_m += corner_weight * cell.bricks[corner]->distance_m[cell.index[corner]];
      result.weight += corner_weight * weight;
    }
    return result;
  }

 private:
  const FieldBrick* neighbour(int offset) {
    if (!looked_up_[offset]) {
      bricks_[offset] =
          field_.brick({key_[0] + (offset & 1), key_[1] + ((offset >> 1) & 1), key_[2] + ((offset >> 2) & 1)});
      looked_up_[offset] = true;
    }
    return bricks_[offset];
  }

  const DistanceField& field_;
  bool has_key_ = false;
  BrickKey key_{};
  std::array<bool, 8> looked_up_{};
  std::array<const FieldBrick*, 8> bricks_{};
};

/// Value and gradient (metres per voxel) of the trilinear interpolant; empty where Reader::sample is.
std::optional<FieldSlope> cell_slope(Reader& reader, const Eigen::Vector3f& position_voxels) {
  Cell cell;
  if (!reader.find(position_voxels, cell)) return std::nullopt;
  FieldSlope slope{0, Eigen::Vector3f::Zero()};
  for (int corner = 0; corner < 8; ++corner) {
    if (!cell.bricks[corner] || cell.bricks[corner]->weight[cell.index[corner]] <= 0) return std::nullopt;
    const float distance = cell.bricks[corner]->distance_m[cell.index[corner]];
    const Eigen::Vector3f along((corner & 1) ? cell.fraction.x() : 1 - cell.fraction.x(),
                                (corner & 2) ? cell.fraction.y() : 1 - cell.fraction.y(),
                                (corner & 4) ? cell.fraction.z() : 1 - cell.fraction.z());
    slope.distance_m += along.x() * along.y() * along.z() * distance;
    slope.gradient.x() += ((corner & 1) ? distance : -distance) * along.y() * along.z();
    slope.gradient.y() += ((corner & 2) ? distance : -distance) * along.x() * along.z();
    slope.gradient.z() += ((corner & 4) ? distance : -distance) * along.x() * along.y();
  }
  return slope;
}

std::optional<Eigen::Vector3f> unit(const Eigen::Vector3f& v) {
  const float length = v.norm();
  if (!(length > 0)) return std::nullopt;
  return v / length;
}

std::optional<Eigen::Vector3f> normal_at(Reader& reader, const Eigen::Vector3f& position_voxels) {
  Eigen::Vector3f gradient;
  for (int axis = 0; axis < 3; ++axis) {
    const Eigen::Vector3f step = Eigen::Vector3f::Unit(axis);
    const auto ahead = reader.sample(position_voxels + step);
    const auto behind = reader.sample(position_voxels - step);
    if (!ahead || !behind) return std::nullopt;
    gradient[axis] = ahead->distance_m - behind->distance_m;
  }
  return unit(gradient);
}

/// DistanceField::raycast without the coarse field.
std::optional<RayHit> cast_in_own_bricks(const DistanceField& field, const Eigen::Vector3f& from_m,
                                         const Eigen::Vector3f& direction, float near_m, float far_m) {
  // Units are voxels: a brick is 8 long, and cells start at integers.
  Reader reader(field);
  const Eigen::Vector3f origin = from_m / field.voxel_m;
  const float end = far_m / field.voxel_m;
  float t = std::min(near_m / field.voxel_m, end);
  std::optional<float> last_distance;  // previous sample in voxels; empty where unknown
  float last_t = t;

  for (bool last_step = false; !last_step;) {
    if (t >= end) {
      t = end;
      last_step = true;
    }
    const Eigen::Vector3f p = origin + t * direction;
    const auto here = reader.sample(p);
    if (here) {
      const float distance = here->distance_m / field.voxel_m;
      if (last_distance && *last_distance > 0 && distance <= 0) {
        // The crossing is in [last_t, t]: regula falsi, as long as the interpolant is known.
        float low = last_t, high = t, low_distance = *last_distance, high_distance = distance;
        float crossing = high;
        for (int i = 0; i < 4; ++i) {
          crossing = low + (high - low) * low_distance / (low_distance - high_distance);
          const auto between = reader.sample(origin + crossing * direction);
          if (!between) break;
          const float value = between->distance_m / field.voxel_m;
          if (value > 0) {
            low = crossing;
            low_distance = value;
          } else {
            high = crossing;
            high_distance = value;
          }
          if (std::abs(value) < 1e-4f) break;
        }
        RayHit hit;
        const Eigen::Vector3f at = origin + crossing * direction;
        hit.position_m = at * field.voxel_m;
        hit.distance_m = crossing * field.voxel_m;
        auto normal = normal_at(reader, at);
        if (!normal) {
          if (const auto slope = cell_slope(reader, at)) normal = unit(slope->gradient);
        }
        hit.normal = normal.value_or(-direction);
        return hit;
      }
      last_distance = distance;
      last_t = t;
      // Steps of half the distance, since distances observed at grazing angles may be too large.
      t += std::max(0.5f, 0.5f * distance);
      continue;
    }
    last_distance.reset();
    const Eigen::Vector3i voxel = rounded_down(p);
    const BrickKey key = brick_of(voxel);
    if (field.brick(key)) {
      t += 0.5f;
      continue;
    }
    // The brick does not exist: continue where the ray leaves it.
    float leave = end - t;
    for (int axis = 0; axis < 3; ++axis) {
      if (direction[axis] == 0) continue;
      const float wall = static_cast<float>(kBrickEdge * (key[axis] + (direction[axis] > 0 ? 1 : 0)));
      leave = std::min(leave, (wall - p[axis]) / direction[axis]);
    }
    t += std::max(leave, 0.0f) + 1e-3f;
  }
  return std::nullopt;
}

}  // namespace

const FieldBrick* DistanceField::brick(const BrickKey& key) const {
  const auto found = bricks.find(key);
  return found == bricks.end() ? nullptr : found->second.get();
}

std::optional<FieldSample> DistanceField::sample(const Eigen::Vector3f& position_m) const {
  Reader reader(*this);
  const auto sample = reader.sample(position_m / voxel_m);
  return sample || !coarse ? sample : coarse->sample(position_m);
}

std::optional<Eigen::Vector3f> DistanceField::normal(const Eigen::Vector3f& position_m) const {
  Reader reader(*this);
  const auto normal = normal_at(reader, position_m / voxel_m);
  return normal || !coarse ? normal : coarse->normal(position_m);
}

std::optional<FieldSlope> DistanceField::slope(const Eigen::Vector3f& position_m) const {
  Reader reader(*this);
  auto result = cell_slope(reader, position_m / voxel_m);
  if (result) result->gradient /= voxel_m;
  return result || !coarse ? result : coarse->slope(position_m);
}

std::optional<Eigen::Vector3f> DistanceField::radiance(const Eigen::Vector3f& position_m) const {
  Reader reader(*this);
  Cell cell;
  const auto coarsely = [&] { return coarse ? coarse->radiance(position_m) : std::nullopt; };
  if (!reader.find(position_m / voxel_m, cell)) return coarsely();
  Eigen::Vector3f sum = Eigen::Vector3f::Zero();
  float weight_sum = 0;
  for (int corner = 0; corner < 8; ++corner) {
    if (!cell.bricks[corner]) continue;
    const float weight = cell.corner_weight(corner) * cell.bricks[corner]->radiance_weight(cell.index[corner]);
    sum += weight * cell.bricks[corner]->radiance(cell.index[corner]);
    weight_sum += weight;
  }
  if (!(weight_sum > 0)) return coarsely();
  return sum / weight_sum;
}

bool DistanceField::has_brick_at(const Eigen::Vector3f& position_m) const {
  return brick(brick_of(rounded_down(position_m / voxel_m + Eigen::Vector3f::Constant(0.5f)))) != nullptr;
}

std::optional<RayHit> DistanceField::raycast(const Eigen::Vector3f& from_m, const Eigen::Vector3f& direction,
                                             float near_m, float far_m) const {
  const auto hit = cast_in_own_bricks(*this, from_m, direction, near_m, far_m);
  if (!coarse) return hit;
  float from = near_m;
  const float end = hit ? hit->distance_m : far_m;
  while (const auto far = coarse->raycast(from_m, direction, from, end)) {
    if (!has_brick_at(far->position_m)) return far;
    from = far->distance_m + coarse->voxel_m;
  }
  return hit;
}

}  // namespace lumigraft::reconstruct
