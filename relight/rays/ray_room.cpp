#include "relight/rays/ray_room.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace lumigraft::rays {
namespace {

using Eigen::Vector3f;

constexpr float kTagWithBorder = 10.0f / 8;  // tag36h11: eight modules of black square, one of white on each side
constexpr float kPaperNear_m = 0.005f;       // to the tag's plane
constexpr float kPatch_m = 0.02f;            // between patches of known surfaces

bool is_flat_enough(const Vector3f& p_m) { return std::abs(p_m.z()) < kPaperNear_m; }

void add_patches(const Model& model, std::vector<Patch>& patches) {
  for (std::size_t t = 0; t + 2 < model.indices.size(); t += 3) {
    const Vector3f &a = model.positions_m[model.indices[t]], &b = model.positions_m[model.indices[t + 1]],
                   &c = model.positions_m[model.indices[t + 2]];
    const Vector3f n = (b - a).cross(c - a).stableNormalized();
    const int steps = std::clamp(static_cast<int>(std::max((b - a).norm(), (c - a).norm()) / kPatch_m) + 1, 1, 200);
    for (int i = 0; i < steps; ++i) {
      for (int j = 0; i + j < steps; ++j) {
        const float u = (static_cast<float>(i) + 0.33f) / static_cast<float>(steps),
                    v = (static_cast<float>(j) + 0.33f) / static_cast<float>(steps);
        patches.push_back({a + u * (b - a) + v * (c - a), n});
      }
    }
  }
}

}  // namespace

RayRoom::RayRoom(const Scene& scene, const std::vector<KnownSurface>& known, float tag_size_m)
    : scene_(reference_room_of(scene, known)),
      paper_m_(tag_size_m * kTagWithBorder),
      field_(scene.field),
      albedo_(scene.albedo),
      illumination_(scene.illumination) {
  meshes_ = std::make_unique<reference::Meshes>(scene_.real, nullptr);
  sky_ = std::make_unique<reference::Sky>(scene_);
  before_.resize(scene_.real.size());
  facets_.resize(scene_.real.size());
  colored_.resize(scene_.real.size());
  for (std::size_t i = 0; i < scene_.real.size(); ++i) {
    const Model& model = *scene_.real[i].model;
    const bool is_known = scene_.real[i].material.has_value();
    if (is_known) {
      add_patches(model, patches_);
      continue;
    }
    const bool fused = i == 0;
    for (std::size_t v = 0; v < model.positions_m.size(); ++v) {
      const Vector3f& p = model.positions_m[v];
      const auto measured = fused ? scene.field->radiance(p) : std::nullopt;
      before_[i].push_back(measured ? measured->array().eval()
                                    : fisheye_radiance(*scene.illumination, p).array().eval());
      colored_[i].push_back((!fused || measured) && model.colors[v].maxCoeff() > 0);
      patches_.push_back({p, model.normals[v]});
    }
    for (std::size_t t = 0; t + 2 < model.indices.size(); t += 3) {
      const std::uint32_t* corner = &model.indices[t];
      const auto& p = model.positions_m;
      RoomFacet& facet = facets_[i].emplace_back();
      facet.fused = fused;
      facet.normal = (p[corner[1]] - p[corner[0]]).cross(p[corner[2]] - p[corner[0]]).stableNormalized();
      for (int k = 0; k < 3; ++k) {
        facet.albedo += model.colors[corner[k]].array() / 3;
        facet.before += before_[i][corner[k]] / 3;
      }
    }
  }
}

RealPoint RayRoom::point(const reference::MeshHit& hit, const Vector3f& w) const {
  RealPoint point{meshes_->surface(hit, w)};
  const std::vector<Rgb>& before = before_[hit.mesh];
  if (!before.empty()) {
    const Model& model = *scene_.real[hit.mesh].model;
    const std::uint32_t* corner = &model.indices[3 * std::size_t{hit.triangle}];
    float weight[3] = {1 - hit.u - hit.v, hit.u, hit.v};
    // At the end of what is known, that alone counts.
    const bool any = std::any_of(corner, corner + 3, [&](std::uint32_t v) { return colored_[hit.mesh][v]; });
    float sum = 0;
    for (int k = 0; k < 3; ++k) {
      if (any && !colored_[hit.mesh][corner[k]]) weight[k] = 0;
      sum += weight[k] = std::max(weight[k], 1e-6f * (any ? static_cast<float>(colored_[hit.mesh][corner[k]]) : 1));
    }
    point.surface.look.diffuse.setZero();
    for (int k = 0; k < 3; ++k) {
      point.before += weight[k] / sum * before[corner[k]];
      point.surface.look.diffuse += weight[k] / sum * model.colors[corner[k]].array();
    }
    return point;
  }
  const Vector3f& p = point.surface.position_m;
  if (is_flat_enough(p) && p.head<2>().cwiseAbs().maxCoeff() < 0.5f * paper_m_) {
    if (const auto measured = field_->radiance(p)) {
      point.surface.look = {};
      if (albedo_) point.surface.look.diffuse = albedo_near(*albedo_, p).array();
      point.before = measured->array();
      return point;
    }
  }
  point.before.setConstant(std::numeric_limits<float>::quiet_NaN());
  return point;
}

}  // namespace lumigraft::rays
