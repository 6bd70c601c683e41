#include "reconstruct/albedo/albedo_bricks.h"

#include <unordered_map>

#include "reconstruct/albedo/parameters.h"

namespace lumigraft::reconstruct {
namespace {

using OpenBricks = std::unordered_map<BrickKey, std::shared_ptr<AlbedoBrick>, BrickKeyHash>;

struct Front {
  Eigen::Vector3i voxel;
  int point;
};

/// Writes each voxel once. Remembers the last brick, which neighbours usually share.
class Writer {
 public:
  explicit Writer(OpenBricks& bricks) : bricks_(bricks) {}

  bool claim(const Eigen::Vector3i& voxel, const PointAlbedo& value) {
    const BrickKey key{voxel.x() >> 3, voxel.y() >> 3, voxel.z() >> 3};
    if (!brick_ || key != key_) {
      auto& slot = bricks_[key];
      if (!slot) {
        slot = std::make_shared<AlbedoBrick>();
        slot->albedo.fill(Eigen::Vector3f::Zero());
        slot->sigma.fill(kUnclaimed);
      }
      key_ = key;
      brick_ = slot.get();
    }
    const int index = (voxel.x() & 7) + kBrickEdge * ((voxel.y() & 7) + kBrickEdge * (voxel.z() & 7));
    if (brick_->sigma[index] != kUnclaimed) return false;
    brick_->albedo[index] = value.albedo;
    brick_->sigma[index] = value.sigma;
    return true;
  }

  static constexpr float kUnclaimed = -2;

 private:
  OpenBricks& bricks_;
  BrickKey key_{};
  AlbedoBrick* brick_ = nullptr;
};

constexpr const AlbedoParameters::Bricks& kBricks = kAlbedoParameters.bricks;

/// Whether `old` can replace `now`: it is known where `now` is, and the difference is not visible.
bool visually_equal(const AlbedoBrick& now, const AlbedoBrick& old) {
  float sum = 0;
  int known = 0;
  for (int i = 0; i < kBrickVoxels; ++i) {
    if (now.sigma[i] < 0) continue;
    if (old.sigma[i] < 0) return false;
    const float squared = (now.albedo[i] - old.albedo[i]).squaredNorm() / 3;
    if (squared > kBricks.same_max * kBricks.same_max) return false;
    sum += squared;
    ++known;
  }
  return sum <= kBricks.same_rms * kBricks.same_rms * static_cast<float>(known);
}

}  // namespace

BrickMap<AlbedoBrick> albedo_bricks(const std::vector<SurfacePoint>& points, const std::vector<PointAlbedo>& albedo) {
  OpenBricks open;
  Writer writer(open);
  std::vector<Front> front, next;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const SurfacePoint& p = points[i];
    const Eigen::Vector3i voxel(p.brick[0] * kBrickEdge + (p.index & 7), p.brick[1] * kBrickEdge + ((p.index >> 3) & 7),
                                p.brick[2] * kBrickEdge + (p.index >> 6));
    if (writer.claim(voxel, albedo[i])) front.push_back({voxel, static_cast<int>(i)});
  }
  for (int step = 0; step < kBricks.reach; ++step) {
    next.clear();
    for (const Front& from : front) {
      for (int side = 0; side < 6; ++side) {
        Eigen::Vector3i voxel = from.voxel;
        voxel[side >> 1] += (side & 1) ? 1 : -1;
        if (writer.claim(voxel, albedo[static_cast<std::size_t>(from.point)])) next.push_back({voxel, from.point});
      }
    }
    front.swap(next);
  }
  BrickMap<AlbedoBrick> bricks;
  for (auto& [key, brick] : open) {
    for (float& sigma : brick->sigma) sigma = sigma == Writer::kUnclaimed ? -1 : sigma;
    bricks.emplace(key, std::move(brick));
  }
  return bricks;
}

void keep_unchanged(BrickMap<AlbedoBrick>& bricks, const BrickMap<AlbedoBrick>& before) {
  for (const auto& [key, old] : before) {
    const auto now = bricks.find(key);
    if (now != bricks.end() && visually_equal(*now->second, *old)) bricks[key] = old;
  }
}

}  // namespace lumigraft::reconstruct
