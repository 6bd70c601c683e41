#include "reconstruct/field/metal_mask.h"

#include <algorithm>
#include <cmath>

#include "reconstruct/field/parameters.h"
#include "reconstruct/field/real_surface_mesh.h"
#include "reconstruct/math/tag_family.h"

namespace lumigraft::reconstruct {
namespace {

constexpr float kCell_m = kFieldParameters.metal_cell_m;

}  // namespace

MetalMask::MetalMask(const capture::Session& session) : tag_reach_m_(0.5 * print_edge_m(session.tag)) {
  for (const capture::RealSurface& surface : session.real_surfaces) {
    if (surface.metallic < kFieldParameters.min_metallic) continue;
    for (const auto& [a, b, c] : read_triangles(surface)) {
      const float longest = std::max({(b - a).norm(), (c - a).norm(), (c - b).norm()});
      const int steps = std::max(1, static_cast<int>(std::ceil(2 * longest / kCell_m)));
      for (int i = 0; i <= steps; ++i) {
        for (int j = 0; i + j <= steps; ++j) {
          cells_.insert(cell(a + (b - a) * (float(i) / steps) + (c - a) * (float(j) / steps)));
        }
      }
    }
  }
}

BrickKey MetalMask::cell(const Eigen::Vector3f& position_m) const {
  const Eigen::Vector3f at = (position_m / kCell_m).array().round();
  return {static_cast<int>(at.x()), static_cast<int>(at.y()), static_cast<int>(at.z())};
}

bool MetalMask::contains(const Eigen::Vector3f& position_m) const {
  if (cells_.empty()) return false;
  if (std::abs(position_m.x()) < tag_reach_m_ && std::abs(position_m.y()) < tag_reach_m_ &&
      std::abs(position_m.z()) < kFieldParameters.tag_slack_m) {
    return false;
  }
  const BrickKey centre = cell(position_m);
  for (int dz = -1; dz <= 1; ++dz) {
    for (int dy = -1; dy <= 1; ++dy) {
      for (int dx = -1; dx <= 1; ++dx) {
        if (cells_.count({centre[0] + dx, centre[1] + dy, centre[2] + dz})) return true;
      }
    }
  }
  return false;
}

}  // namespace lumigraft::reconstruct
