#include "relight/gather/recently_moved.h"

#include "relight/gather/parameters.h"

namespace lumigraft::relight {
namespace {

reconstruct::BrickKey cell_of(const Eigen::Vector3f& p_m) {
  const Eigen::Vector3i at = (p_m / kGather.recent_cell_m).array().floor().cast<int>();
  return {at.x(), at.y(), at.z()};
}

}  // namespace

void RecentlyMoved::add(const MovedPixels& moved, const MovedPixels& fused, std::int64_t time_ns) {
  std::erase_if(last_ns_, [&](const auto& entry) { return time_ns - entry.second > kGather.recent_ns; });
  for (std::size_t i = 0; i < moved.size(); ++i) {
    const GBufferPixel &now = moved[i].second, &before = fused[i].second;
    if (!before.known || now.depth_m < before.depth_m) last_ns_[cell_of(now.surface.position_m)] = time_ns;
  }
  box_.setEmpty();
  for (const auto& [cell, ns] : last_ns_) {
    const Eigen::Vector3f low_m =
        kGather.recent_cell_m *
        Eigen::Vector3f(static_cast<float>(cell[0]), static_cast<float>(cell[1]), static_cast<float>(cell[2]));
    box_.extend(low_m - Eigen::Vector3f::Constant(kGather.recent_cell_m));
    box_.extend(low_m + Eigen::Vector3f::Constant(2 * kGather.recent_cell_m));
  }
}

bool RecentlyMoved::contains(const Eigen::Vector3f& p_m) const {
  const Eigen::Vector3f half = Eigen::Vector3f::Constant(kGather.recent_cell_m / 2);
  for (int corner = 0; corner < 8; ++corner) {
    const Eigen::Vector3f side(corner & 1 ? 1 : -1, corner & 2 ? 1 : -1, corner & 4 ? 1 : -1);
    if (last_ns_.contains(cell_of(p_m + half.cwiseProduct(side)))) return true;
  }
  return false;
}

}  // namespace lumigraft::relight
