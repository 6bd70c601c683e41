#include "reconstruct/albedo/known_surface.h"

#include <algorithm>
#include <cstddef>

#include "reconstruct/albedo/parameters.h"

namespace lumigraft::reconstruct {

KnownSurface::KnownSurface(const Surface& surface, const std::vector<SampleAlbedo>& albedo, double print_edge_m) {
  std::vector<std::size_t> known;
  for (std::size_t i = 0; i < surface.samples.size(); ++i)
    if (surface.samples[i].usable && albedo[i].sigma >= 0 && !on_tag_print(surface.samples[i], print_edge_m))
      known.push_back(i);
  const std::size_t count = std::min(known.size(), kAlbedoParameters.following.max_samples);
  std::vector<int> index(surface.samples.size(), -1);
  for (std::size_t k = 0; k < count; ++k) {
    const std::size_t i = known[k * known.size() / count];
    index[i] = static_cast<int>(k);
    samples_.push_back({surface.samples[i], {}});
    samples_.back().surface.known = albedo[i];
  }
  for (const SurfacePoint& point : surface.points) {
    const int of = point.sample < 0 ? -1 : index[static_cast<std::size_t>(point.sample)];
    if (of >= 0) samples_[static_cast<std::size_t>(of)].voxels.emplace_back(point.brick, point.index);
  }
}

std::vector<SurfaceSample> KnownSurface::in(const DistanceField& field) const {
  std::vector<SurfaceSample> result;
  result.reserve(samples_.size());
  for (const Sample& sample : samples_) {
    Eigen::Vector3f sum = Eigen::Vector3f::Zero();
    int count = 0;
    for (const auto& [key, index] : sample.voxels) {
      const FieldBrick* brick = field.brick(key);
      if (!brick || !on_surface(*brick, index, field.voxel_m)) continue;
      sum += brick->radiance(static_cast<std::size_t>(index));
      ++count;
    }
    // Where surface moved the rest of a patch is something else.
    if (2 * count < static_cast<int>(sample.voxels.size()) || count == 0) continue;
    result.push_back(sample.surface);
    result.back().radiance = sum / static_cast<float>(count);
  }
  return result;
}

}  // namespace lumigraft::reconstruct
