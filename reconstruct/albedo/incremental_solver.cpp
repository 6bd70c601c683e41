#include "reconstruct/albedo/incremental_solver.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "reconstruct/albedo/sample_solver.h"

namespace lumigraft::reconstruct {
namespace {

constexpr float kOtherLook = 0.02f;  ///< of radiance, of the voxels' number: what lamps' light is known to at best
constexpr float kElsewhere = 1;      ///< voxels

template <typename Visit>
void around(const BrickKey& key, const Visit& visit) {
  for (int k = 0; k < 27; ++k) visit(BrickKey{key[0] + k % 3 - 1, key[1] + k / 3 % 3 - 1, key[2] + k / 9 - 1});
}

/// Which voxels of a brick lie in a changed one, or within so many voxels of it (less than a brick's edge).
class Near {
 public:
  Near(const BrickKey& key, const std::set<BrickKey>& changed, int reach) : reach_(reach) {
    around(key, [&](const BrickKey& k) {
      if (changed.contains(k)) offsets_.push_back({k[0] - key[0], k[1] - key[1], k[2] - key[2]});
    });
  }
  bool operator()(int index) const {
    const std::array<int, 3> at{index & 7, (index >> 3) & 7, index >> 6};
    return std::any_of(offsets_.begin(), offsets_.end(), [&](const BrickKey& offset) {
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const int away = offset[axis] == 0 ? 0 : offset[axis] < 0 ? at[axis] + 1 : kBrickEdge - at[axis];
        if (away > reach_) return false;
      }
      return true;
    });
  }

 private:
  int reach_;
  std::vector<BrickKey> offsets_;
};

AlbedoBrick unknown_brick() {
  AlbedoBrick brick;
  brick.albedo.fill(Eigen::Vector3f::Zero());
  brick.sigma.fill(-1);
  return brick;
}

}  // namespace

IncrementalSolver::Look IncrementalSolver::look_of(const FieldBrick& brick, float voxel_m) {
  Look look;
  Eigen::Vector3i sum = Eigen::Vector3i::Zero();
  for (int i = 0; i < kBrickVoxels; ++i) {
    if (!on_surface(brick, i, voxel_m)) continue;
    ++look.count;
    look.radiance += brick.radiance[i];
    sum += Eigen::Vector3i(i & 7, (i >> 3) & 7, i >> 6);
  }
  if (look.count > 0) {
    look.radiance /= look.count;
    look.middle = sum.cast<float>() / look.count;
  }
  return look;
}

bool IncrementalSolver::Look::differs(const Look& other) const {
  return std::abs(count - other.count) > kOtherLook * std::max(count, other.count) + 1 ||
         (radiance - other.radiance).norm() > kOtherLook * std::max(radiance.norm(), other.radiance.norm()) ||
         (middle - other.middle).cwiseAbs().maxCoeff() > kElsewhere;
}

void IncrementalSolver::keep(const DistanceField& field, const Surface& surface,
                             const std::vector<Eigen::Vector3f>& gathered, const std::vector<SampleAlbedo>& albedo,
                             const std::vector<PointAlbedo>& points, float dark) {
  forget();
  voxel_m_ = field.voxel_m;
  sample_m_ = surface.sample_m;
  dark_ = dark;
  seen_ = field.bricks;
  for (const auto& [key, brick] : field.bricks) {
    const Look look = look_of(*brick, field.voxel_m);
    if (look.count == 0) continue;
    bricks_[key].look = look;
    count_ += look.count;
  }
  Brick* brick = nullptr;
  for (std::size_t i = 0; i < surface.points.size(); ++i) {
    const SurfacePoint& point = surface.points[i];
    if (i == 0 || point.brick != surface.points[i - 1].brick) brick = &bricks_[point.brick];
    brick->points.push_back(point);
    brick->albedo.push_back(points[i]);
  }
  for (std::size_t i = 0; i < surface.samples.size(); ++i)
    samples_.emplace_hint(samples_.end(), surface.cells[i], Sample{surface.samples[i], gathered[i], albedo[i]});
}

IncrementalSolver::Change IncrementalSolver::change(const DistanceField& field) const {
  Change change;
  change.points = count_;
  std::set<BrickKey> others = since_all_;
  const auto add = [&](const BrickKey& key, float count, float before) {
    change.bricks.push_back(key);
    change.points += count - before;
    others.insert(key);
  };
  for (const auto& [key, brick] : field.bricks) {
    const auto seen = seen_.find(key);
    if (seen != seen_.end() && seen->second == brick) continue;
    change.published.push_back(key);
    const auto known = bricks_.find(key);
    const Look now = look_of(*brick, field.voxel_m);
    if (known == bricks_.end() ? now.count > 0 : now.differs(known->second.look))
      add(key, now.count, known == bricks_.end() ? 0 : known->second.look.count);
  }
  for (const auto& [key, brick] : seen_) {
    if (field.brick(key)) continue;
    change.published.push_back(key);
    if (const auto known = bricks_.find(key); known != bricks_.end()) add(key, 0, known->second.look.count);
  }
  std::sort(change.bricks.begin(), change.bricks.end());
  change.share = static_cast<double>(others.size()) / std::max<double>(1, static_cast<double>(bricks_.size()));
  return change;
}

/// Reads the points of these bricks again. Gives the cells that they are in, or were.
std::set<SampleCell> IncrementalSolver::refresh_points(const DistanceField& field, const FieldRays& rays,
                                                       const MetalMask& metal, const std::vector<BrickKey>& changed) {
  std::set<SampleCell> cells;
  const auto touch = [&](const std::vector<SurfacePoint>& points) {
    for (const SurfacePoint& point : points)
      if (!point.metal) cells.insert(cell_of(point, sample_m_));
  };
  for (const BrickKey& key : changed) {
    Brick& brick = bricks_[key];
    touch(brick.points);
    count_ -= brick.look.count;
    if (!field.brick(key)) {
      bricks_.erase(key);
      continue;
    }
    brick.look = look_of(*field.brick(key), field.voxel_m);
    brick.points = points_in(field, key, rays, metal);
    brick.albedo.assign(brick.points.size(), {});
    count_ += brick.look.count;
    touch(brick.points);
    if (brick.look.count == 0) bricks_.erase(key);
  }
  return cells;
}

std::size_t IncrementalSolver::solve(const DistanceField& field, const FieldRays& rays, const MetalMask& metal,
                                     const Light& light, const Change& change, BrickMap<AlbedoBrick>& bricks) {
  for (const BrickKey& key : change.published) {
    const auto now = field.bricks.find(key);
    if (now == field.bricks.end()) {
      seen_.erase(key);
    } else {
      seen_[key] = now->second;
    }
  }
  const std::vector<BrickKey>& changed = change.bricks;
  if (changed.empty()) return 0;
  since_all_.insert(changed.begin(), changed.end());
  const std::set<SampleCell> cells = refresh_points(field, rays, metal, changed);

  // All points of these cells, of other bricks too.
  std::set<BrickKey> holding(changed.begin(), changed.end());
  const float brick_m = voxel_m_ * kBrickEdge, half_voxel_m = 0.5f * voxel_m_;
  for (const auto& [level, x, y, z, side] : cells) {
    const float edge_m = sample_m_ * static_cast<float>(1 << level);
    const Eigen::Vector3f low = edge_m * Eigen::Vector3i(x, y, z).cast<float>();
    const auto brick_at = [&](const Eigen::Vector3f& p) {
      return ((p.array() + half_voxel_m) / brick_m).floor().cast<int>().matrix().eval();
    };
    const Eigen::Vector3i first = brick_at(low.array() - voxel_m_), last = brick_at(low.array() + edge_m + voxel_m_);
    for (int a = first.x(); a <= last.x(); ++a)
      for (int b = first.y(); b <= last.y(); ++b)
        for (int c = first.z(); c <= last.z(); ++c) holding.insert({a, b, c});
  }
  std::vector<SurfacePoint> near;
  std::map<SampleCell, std::vector<int>> members;
  for (const BrickKey& key : holding) {
    const auto brick = bricks_.find(key);
    if (brick == bricks_.end()) continue;
    for (const SurfacePoint& point : brick->second.points) {
      const SampleCell cell = point.metal ? SampleCell{} : cell_of(point, sample_m_);
      if (point.metal || !cells.contains(cell)) continue;
      members[cell].push_back(static_cast<int>(near.size()));
      near.push_back(point);
    }
  }

  Surface part;
  part.sample_m = sample_m_;
  std::vector<Eigen::Vector3f> gathered;
  std::map<SampleCell, int> place;
  for (const SampleCell& cell : cells) samples_.erase(cell);
  for (const auto& [cell, of_cell] : members) {
    const SurfaceSample sample = patch(near, of_cell, cell, sample_m_);
    const IrradianceModel::Gathered around_it = light.room.gather(sample.position, sample.normal, light.rays);
    gathered.push_back(around_it.irradiance + light.room.by_floor(around_it, light.on_floor));
    place[cell] = static_cast<int>(part.samples.size());
    part.samples.push_back(sample);
    part.cells.push_back(cell);
  }
  const std::size_t open = part.samples.size();
  std::vector<SampleAlbedo> held;
  for (const auto& [cell, sample] : samples_) {
    const bool next_to = std::any_of(
        part.samples.begin(), part.samples.begin() + static_cast<std::ptrdiff_t>(open), [&](const SurfaceSample& own) {
          const float reach_m = LitSurface::kNeighbourReach * own.size_m;
          return (own.position - sample.surface.position).squaredNorm() < reach_m * reach_m;
        });
    if (!next_to) continue;
    part.samples.push_back(sample.surface);
    gathered.push_back(sample.gathered);
    held.push_back(sample.albedo);
  }
  for (const BrickKey& key : changed) {
    const auto brick = bricks_.find(key);
    if (brick == bricks_.end()) continue;
    for (SurfacePoint point : brick->second.points) {
      if (!point.metal) point.sample = place.at(cell_of(point, sample_m_));
      part.points.push_back(point);
    }
  }

  const LitSurface lit(part, light.room, light.illumination, gathered, dark_, held);
  const std::vector<SampleAlbedo> albedo =
      solve_albedo(part.samples, lit.sample_light(), lit.neighbours(), dark_, held);
  const std::vector<PointAlbedo> points = lit.albedo(albedo);
  for (std::size_t i = 0; i < open; ++i) samples_[part.cells[i]] = {part.samples[i], gathered[i], albedo[i]};
  std::size_t next = 0;
  for (const BrickKey& key : changed) {
    const auto brick = bricks_.find(key);
    if (brick == bricks_.end()) continue;
    for (PointAlbedo& point : brick->second.albedo) point = points[next++];
  }
  write(changed, bricks);
  return open;
}

void IncrementalSolver::write(const std::vector<BrickKey>& changed, BrickMap<AlbedoBrick>& bricks) const {
  const std::set<BrickKey> own(changed.begin(), changed.end());
  std::set<BrickKey> written;
  for (const BrickKey& key : changed) around(key, [&](const BrickKey& k) { written.insert(k); });
  // What points of changed bricks reach may be nearest to points that are as far from it.
  std::vector<SurfacePoint> points;
  std::vector<PointAlbedo> albedo;
  for (const BrickKey& key : written) {
    const auto brick = bricks_.find(key);
    if (brick == bricks_.end()) continue;
    const Near near(key, own, 2 * kAlbedoReach);
    for (std::size_t i = 0; i < brick->second.points.size(); ++i) {
      if (!near(brick->second.points[i].index)) continue;
      points.push_back(brick->second.points[i]);
      albedo.push_back(brick->second.albedo[i]);
    }
  }
  const BrickMap<AlbedoBrick> reached = albedo_bricks(points, albedo);
  static const AlbedoBrick nothing = unknown_brick();
  BrickMap<AlbedoBrick> anew, before;
  for (const BrickKey& key : written) {
    const auto was = bricks.find(key);
    const auto now = reached.find(key);
    if (was == bricks.end() && now == reached.end()) continue;
    if (was != bricks.end()) before.insert(*was);
    const AlbedoBrick& from = now == reached.end() ? nothing : *now->second;
    auto brick = std::make_shared<AlbedoBrick>(was == bricks.end() ? nothing : *was->second);
    const Near near(key, own, kAlbedoReach);
    for (int i = 0; i < kBrickVoxels; ++i) {
      if (!near(i)) continue;
      brick->albedo[i] = from.albedo[i];
      brick->sigma[i] = from.sigma[i];
    }
    anew.emplace(key, std::move(brick));
  }
  keep_unchanged(anew, before);
  for (auto& [key, brick] : anew) {
    if (*std::max_element(brick->sigma.begin(), brick->sigma.end()) < 0) {
      bricks.erase(key);
    } else {
      bricks[key] = std::move(brick);
    }
  }
}

}  // namespace lumigraft::reconstruct
