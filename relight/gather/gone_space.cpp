#include "relight/gather/gone_space.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "relight/gather/parameters.h"

namespace lumigraft::relight {

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
