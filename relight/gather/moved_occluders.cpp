#include "relight/gather/moved_occluders.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <utility>
#include <vector>

#include "relight/gather/parameters.h"

namespace lumigraft::relight {
using Eigen::Vector3f;

MovedOccluders::MovedOccluders(const CameraRays& eye, const CurrentDepth& depth, const MovedPixels& moved,
                               const MovedPixels& fused, const Meshes& objects, ArrivedSurface arrived) {
  ReferenceMesh mesh;
  mesh.model = moved_shell(eye, depth, moved, fused, objects, false);
  if (mesh.model) surfaces_ = std::make_unique<Meshes>(std::vector{mesh}, nullptr);
  for (std::size_t i = 0; i < moved.size(); ++i) {
    const GBufferPixel& before = fused[i].second;
    if (before.known && before.depth_m < moved[i].second.depth_m) gone_box_.extend(before.surface.position_m);
  }
  if (!gone_box_.isEmpty()) {
    // The sides that the camera does not see are within a hand's thickness.
    gone_box_.extend(gone_box_.min() - Vector3f::Constant(kGather.gone_margin_m));
    gone_box_.extend(gone_box_.max() + Vector3f::Constant(kGather.gone_margin_m));
  }
  gone_box_.extend(arrived.recent().box());
  if (!gone_box_.isEmpty()) gone_.emplace(eye.camera, depth, std::move(arrived));
}

bool MovedOccluders::blocked(const Meshes& room, const Vector3f& from_m, const Vector3f& w, float limit_m,
                             bool by_room) const {
  if (surfaces_ && surfaces_->blocked(from_m, w, limit_m)) return true;
  return by_room && (!passes_gone(from_m, w, limit_m) || remains(room, from_m, w, limit_m));
}

std::uint32_t MovedOccluders::blocked(const Meshes& room, const RayFan& fan, std::uint32_t by_room) const {
  RayFan open = fan;
  open.some &= ~by_room;
  std::uint32_t all = by_room | (surfaces_ ? surfaces_->blocked(open) : 0);
  for (std::uint32_t rest = gone_box_.isEmpty() ? 0 : by_room; rest != 0; rest &= rest - 1) {
    const auto k = static_cast<std::size_t>(std::countr_zero(rest));
    if (!blocked(room, fan.from_m, fan.w[k], fan.limit_m[k], true)) all &= ~(1u << k);
  }
  return all;
}

bool MovedOccluders::passes_gone(const Vector3f& from_m, const Vector3f& w, float limit_m) const {
  if (gone_box_.isEmpty()) return false;
  const Eigen::Array3f one = (gone_box_.min() - from_m).array() / w.array(),
                       two = (gone_box_.max() - from_m).array() / w.array();
  const float enters = one.min(two).maxCoeff(), leaves = one.max(two).minCoeff();
  return leaves >= std::max(enters, 0.0f) && enters < limit_m;
}

/// Whether the fused room blocks a ray by surface that is not gone.
bool MovedOccluders::remains(const Meshes& room, const Vector3f& from_m, const Vector3f& w, float limit_m) const {
  float passed_m = 0;
  for (int surfaces = 0; surfaces < kGather.gone_surfaces; ++surfaces) {
    const auto hit = room.hit(from_m + passed_m * w, w, limit_m - passed_m);
    if (!hit) return false;
    passed_m += hit->t_m;
    if (room.hides(*hit) && !gone_->contains(from_m + passed_m * w)) return true;
    passed_m += kGather.lift_m;
  }
  return true;
}

}  // namespace lumigraft::relight
