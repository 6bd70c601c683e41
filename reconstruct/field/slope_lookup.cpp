#include "reconstruct/field/slope_lookup.h"

namespace lumigraft::reconstruct {
namespace {

/// Floor. std::floor is a library call without SSE 4.1, which baseline x86-64 lacks.
int floor_of(float x) {
  const int toward_zero = static_cast<int>(x);
  return toward_zero - (x < static_cast<float>(toward_zero) ? 1 : 0);
}

/// Of the trilinear interpolant of eight corners (bit 0 = +x, bit 1 = +y, bit 2 = +z), per voxel.
FieldSlope interpolated(const std::array<float, 8>& d, const Eigen::Vector3f& fraction) {
  const float x = fraction.x(), y = fraction.y(), z = fraction.z();
  float along_x[4], by_x[4];  // at the four edges along x
  for (int edge = 0; edge < 4; ++edge) {
    by_x[edge] = d[2 * edge + 1] - d[2 * edge];
    along_x[edge] = d[2 * edge] + x * by_x[edge];
  }
  const float low = along_x[0] + y * (along_x[1] - along_x[0]), high = along_x[2] + y * (along_x[3] - along_x[2]);
  FieldSlope slope;
  slope.distance_m = low + z * (high - low);
  slope.gradient = {(1 - z) * ((1 - y) * by_x[0] + y * by_x[1]) + z * ((1 - y) * by_x[2] + y * by_x[3]),
                    (1 - z) * (along_x[1] - along_x[0]) + z * (along_x[3] - along_x[2]), high - low};
  return slope;
}

}  // namespace

SlopeLookup::SlopeLookup(const DistanceField& field)
    : field_(field),
      places_(std::size_t{1} << (kBits[0] + kBits[1] + kBits[2])),
      coarse_(field.coarse ? std::make_unique<SlopeLookup>(*field.coarse) : nullptr) {}

const FieldBrick* SlopeLookup::brick(const BrickKey& key) {
  const int index = (key[0] & ((1 << kBits[0]) - 1)) | (key[1] & ((1 << kBits[1]) - 1)) << kBits[0] |
                    (key[2] & ((1 << kBits[2]) - 1)) << (kBits[0] + kBits[1]);
  Place& place = places_[static_cast<std::size_t>(index)];
  if (!place.looked_up || place.key != key) place = {key, field_.brick(key), true};
  return place.brick;
}

/// False unless all eight voxels are known.
bool SlopeLookup::corners(const Eigen::Vector3i& voxel, std::array<float, 8>& distance_m) {
  const FieldBrick* first = brick(brick_of(voxel));
  if (!first) return false;
  const bool within = (voxel.array().unaryExpr([](int v) { return v & 7; }) < kBrickEdge - 1).all();
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Vector3i at = voxel + Eigen::Vector3i(corner & 1, (corner >> 1) & 1, corner >> 2);
    const FieldBrick* holder = within ? first : brick(brick_of(at));
    const auto index = static_cast<std::size_t>(index_in_brick(at));
    if (!holder || holder->weight[index] <= 0) return false;
    distance_m[static_cast<std::size_t>(corner)] = holder->distance_m[index];
  }
  return true;
}

std::optional<FieldSlope> SlopeLookup::operator()(const Eigen::Vector3f& position_m) {
  const Eigen::Vector3f position = position_m / field_.voxel_m;
  const Eigen::Vector3i voxel(floor_of(position.x()), floor_of(position.y()), floor_of(position.z()));
  std::array<float, 8> distance_m;
  if (!corners(voxel, distance_m)) return coarse_ ? (*coarse_)(position_m) : std::nullopt;
  FieldSlope slope = interpolated(distance_m, position - voxel.cast<float>());
  slope.gradient /= field_.voxel_m;
  return slope;
}

}  // namespace lumigraft::reconstruct
