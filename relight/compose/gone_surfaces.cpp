#include "relight/compose/gone_surfaces.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "relight/compose/parameters.h"

namespace lumigraft::relight {
namespace {

using Eigen::Vector3f;
using Eigen::Vector3i;
using reconstruct::kBrickEdge;

/// Where known distances change sign between neighbouring voxels of the brick.
std::vector<Vector3f> surface_points(const reconstruct::BrickKey& key, const reconstruct::FieldBrick& brick,
                                     float voxel_m) {
  std::vector<Vector3f> points_m;
  for (int i = 0; i < reconstruct::kBrickVoxels; ++i) {
    const Vector3i voxel = reconstruct::voxel_in(key, i);
    const auto at = static_cast<std::size_t>(i);
    if (!(brick.weight[at] > 0)) continue;
    constexpr std::array<int, 3> kStep{1, kBrickEdge, kBrickEdge * kBrickEdge};
    for (int axis = 0; axis < 3; ++axis) {
      if ((voxel[axis] & (kBrickEdge - 1)) == kBrickEdge - 1) continue;
      const std::size_t next = at + static_cast<std::size_t>(kStep[static_cast<std::size_t>(axis)]);
      const float here_m = brick.distance_m[at], there_m = brick.distance_m[next];
      if (!(brick.weight[next] > 0) || (here_m > 0) == (there_m > 0)) continue;
      Vector3f p = voxel.cast<float>();
      p[axis] += here_m / (here_m - there_m);
      points_m.emplace_back(voxel_m * p);
    }
  }
  return points_m;
}

/// The cells that contain one of the points or are next to one that does; larger ones if there would be too many.
GoneGrid grid_around(const std::vector<Vector3f>& points_m, float cell_m) {
  GoneGrid grid;
  if (points_m.empty()) return grid;
  Eigen::AlignedBox3f box;
  for (const Vector3f& p_m : points_m) box.extend(p_m);
  grid.cell_m = cell_m;
  // The cells do not move with the box.
  const auto cell_of = [&](const Vector3f& p_m) { return Vector3i((p_m / grid.cell_m).array().floor().cast<int>()); };
  Vector3i low;
  for (;; grid.cell_m *= 2) {
    low = cell_of(box.min()).array() - 1;
    grid.size = cell_of(box.max()) - low + Vector3i::Constant(2);
    if (grid.size.cast<double>().prod() <= kCompose.gone_max_cells) break;
  }
  grid.low_m = grid.cell_m * low.cast<float>();
  grid.bits.assign(static_cast<std::size_t>((grid.size.prod() + 31) / 32), 0);
  for (const Vector3f& p_m : points_m) {
    const Vector3i cell = cell_of(p_m) - low;
    for (int i = 0; i < 27; ++i) grid.set(cell + Vector3i(i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1));
  }
  return grid;
}

}  // namespace

GoneGrid GoneSurfaces::find(const reconstruct::DistanceField& field, const Of& is_gone, float min_cell_m,
                            const Of& may_matter) {
  if (std::exchange(voxel_m_, field.voxel_m) != field.voxel_m) surfaces_.clear();
  ++calls_;
  std::vector<Vector3f> gone_m;
  for (const auto& [key, brick] : field.bricks) {
    const Vector3f middle_m =
        field.voxel_m * (reconstruct::first_voxel(key).cast<float>().array() + 0.5f * (kBrickEdge - 1)).matrix();
    if (!may_matter(middle_m)) continue;
    Surface& surface = surfaces_[key];
    if (surface.brick != brick) surface = {brick, surface_points(key, *brick, field.voxel_m)};
    surface.used = calls_;
    const std::size_t before = gone_m.size();
    for (const Vector3f& p_m : surface.points_m)
      if (is_gone(p_m)) gone_m.push_back(p_m);
    if (gone_m.size() == before || static_cast<float>(gone_m.size() - before) <
                                       kCompose.gone_fraction * static_cast<float>(surface.points_m.size())) {
      gone_m.resize(before);
      continue;
    }
    for (int i = 0; i < reconstruct::kBrickVoxels; ++i) {
      const Vector3f p_m = field.voxel_m * reconstruct::voxel_in(key, i).cast<float>();
      if (brick->distance_m[static_cast<std::size_t>(i)] <= 0 && is_gone(p_m)) gone_m.push_back(p_m);
    }
  }
  std::erase_if(surfaces_, [&](const auto& entry) { return entry.second.used != calls_; });
  return grid_around(gone_m, std::max(min_cell_m, static_cast<float>(kCompose.gone_cell_voxels) * field.voxel_m));
}

}  // namespace lumigraft::relight
