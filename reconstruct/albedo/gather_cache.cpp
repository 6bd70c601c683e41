#include "reconstruct/albedo/gather_cache.h"

#include <algorithm>
#include <cmath>
#include <unordered_map>

#include "reconstruct/albedo/parameters.h"
#include "reconstruct/light/light_change.h"

namespace lumigraft::reconstruct {
namespace {

constexpr const AlbedoParameters::Gather& kGather = kAlbedoParameters.gather;

BrickKey cell_of(const Eigen::Vector3f& position, float edge_m) {
  const Eigen::Vector3i cell = (position / edge_m).array().floor().cast<int>();
  return {cell.x(), cell.y(), cell.z()};
}

}  // namespace

std::vector<IrradianceModel::Gathered> GatherCache::gather(const IrradianceModel& room,
                                                           const Illumination& illumination,
                                                           const std::vector<SurfaceSample>& samples,
                                                           std::size_t surface_points, int rays) {
  const bool grown = static_cast<double>(surface_points) > kGather.growth * static_cast<double>(points_);
  if (grown || relative_change(illumination, light_) > kGather.max_light_change) {
    forget();
    light_ = illumination;
    points_ = surface_points;
  }
  float edge_m = 1e-3f;
  for (const SurfaceSample& sample : samples) edge_m = std::max(edge_m, kGather.near_cells * sample.size_m);
  std::unordered_map<BrickKey, std::vector<std::size_t>, BrickKeyHash> cells;
  for (std::size_t i = 0; i < entries_.size(); ++i) cells[cell_of(entries_[i].position, edge_m)].push_back(i);

  std::vector<Entry> next;
  std::vector<IrradianceModel::Gathered> result;
  for (const SurfaceSample& sample : samples) {
    const Entry* best = nullptr;
    float nearest = std::pow(kGather.near_cells * sample.size_m, 2.0f);
    const BrickKey cell = cell_of(sample.position, edge_m);
    for (int k = 0; k < 27; ++k) {
      const auto found = cells.find({cell[0] + k % 3 - 1, cell[1] + k / 3 % 3 - 1, cell[2] + k / 9 - 1});
      if (found == cells.end()) continue;
      for (const std::size_t i : found->second) {
        const float away = (entries_[i].position - sample.position).squaredNorm();
        if (away >= nearest || entries_[i].normal.dot(sample.normal) < kGather.same_normal) continue;
        nearest = away;
        best = &entries_[i];
      }
    }
    if (best && best->turn != solves_ % kGather.refresh) {
      next.push_back(*best);
    } else {
      const std::uint32_t turn = best ? best->turn : ++turns_ % kGather.refresh;
      next.push_back({sample.position, sample.normal, room.gather(sample.position, sample.normal, rays), turn});
    }
    result.push_back(next.back().light);
  }
  entries_ = std::move(next);
  ++solves_;
  return result;
}

}  // namespace lumigraft::reconstruct
