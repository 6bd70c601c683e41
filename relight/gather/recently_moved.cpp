#include "relight/gather/recently_moved.h"

#include <algorithm>

#include "reconstruct/math/depth_noise.h"
#include "relight/gather/parameters.h"

namespace lumigraft::relight {
namespace {

reconstruct::BrickKey cell_of(const Eigen::Vector3f& p_m) {
  const Eigen::Vector3i at = (p_m / kGather.recent_cell_m).array().floor().cast<int>();
  return {at.x(), at.y(), at.z()};
}

/// Whether the cell of the point, or one next to it, counts.
template <typename Counts>
bool any_around(const Eigen::Vector3f& p_m, Counts counts) {
  const Eigen::Vector3f half = Eigen::Vector3f::Constant(kGather.recent_cell_m / 2);
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Vector3f side(corner & 1 ? 1 : -1, corner & 2 ? 1 : -1, corner & 4 ? 1 : -1);
    if (counts(cell_of(p_m + half.cwiseProduct(side)))) return true;
  }
  return false;
}

/// With the cells next to it.
void extend(Eigen::AlignedBox3f& box, const reconstruct::BrickKey& cell) {
  const Eigen::Vector3f low_m =
      kGather.recent_cell_m *
      Eigen::Vector3f(static_cast<float>(cell[0]), static_cast<float>(cell[1]), static_cast<float>(cell[2]));
  box.extend(low_m - Eigen::Vector3f::Constant(kGather.recent_cell_m));
  box.extend(low_m + Eigen::Vector3f::Constant(2 * kGather.recent_cell_m));
}

}  // namespace

void RecentlyMoved::add(const MovedPixels& moved, const MovedPixels& fused,
                        const std::function<bool(const GBufferPixel& fused)>& settled, std::int64_t time_ns) {
  const auto is_old = [&](std::int64_t then_ns) { return time_ns - then_ns > kGather.recent_ns; };
  std::erase_if(cells_, [&](const auto& entry) { return is_old(entry.second.last_ns); });
  for (std::size_t i = 0; i < moved.size(); ++i) {
    const GBufferPixel &now = moved[i].second, &before = fused[i].second;
    if (before.known && !(now.depth_m < before.depth_m)) continue;
    Cell& cell = cells_[cell_of(now.surface.position_m)];
    cell.last_ns = time_ns;
    if (cell.came_ns != time_ns && before.known && settled(before)) cell.came_ns = time_ns;
  }
  box_.setEmpty();
  came_box_.setEmpty();
  for (auto& [key, cell] : cells_) {
    if (cell.came_ns && is_old(*cell.came_ns)) cell.came_ns.reset();
    extend(box_, key);
    if (cell.came_ns) extend(came_box_, key);
  }
}

bool RecentlyMoved::contains(const Eigen::Vector3f& p_m) const {
  return box_.contains(p_m) && any_around(p_m, [&](const reconstruct::BrickKey& key) { return cells_.contains(key); });
}

bool RecentlyMoved::came_to(const Eigen::Vector3f& p_m) const {
  return came_box_.contains(p_m) && any_around(p_m, [&](const reconstruct::BrickKey& key) {
           const auto found = cells_.find(key);
           return found != cells_.end() && found->second.came_ns;
         });
}

ArrivedSurface::Updates ArrivedSurface::updates(const reconstruct::DistanceField& field,
                                                const capture::DepthNoise& noise, const Eigen::Vector3f& p_m,
                                                float depth_m) {
  const auto sample = field.sample(p_m);
  if (!sample) return Updates::none;
  const float sigmas = static_cast<float>(reconstruct::kMinDepthSigma_m) / noise.axial_sigma_m(depth_m);
  const float enough = kGather.settled_updates * std::min(sigmas * sigmas, 1.0f);
  return sample->weight < enough ? Updates::some : Updates::enough;
}

GoneSpace::GoneSpace(const PosedCamera& camera, const CurrentDepth& depth, ArrivedSurface arrived)
    : arrived_(std::move(arrived)), free_(camera, depth), free_z_m_(depth.along_z_m()), hidden_z_m_(depth.along_z_m()) {
  for (float& z : free_z_m_.data) z = z > 0 ? std::max(z - depth.allowed_m(z), 0.0f) : 0;
  for (float& z : hidden_z_m_.data) z = z > 0 ? z + kGather.thickness_m : 0;
}

bool GoneSpace::contains(const Eigen::Vector3f& p_m) const {
  const std::optional<FreeSpace::Place> at = free_.place(p_m);
  if (!at) return false;
  if (free_.contains(*at) || (arrived_.any() && arrived_.contains(p_m, at->z_m))) return true;
  const float hidden_m = hidden_z_m_.at(at->u, at->v);
  return (at->z_m < free_z_m_.at(at->u, at->v) || (hidden_m > 0 && at->z_m > hidden_m)) &&
         arrived_.recent().contains(p_m);
}

}  // namespace lumigraft::relight
