#include "reconstruct/albedo/incremental_solver.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "reconstruct/albedo/parameters.h"
#include "reconstruct/albedo/sample_solver.h"
#include "reconstruct/shading/parameters.h"

namespace lumigraft::reconstruct {
namespace {

constexpr const AlbedoParameters::Incremental& kIncremental = kAlbedoParameters.incremental;
constexpr int kReach = kAlbedoParameters.bricks.reach;

template <typename Visit>
void around(const BrickKey& key, const Visit& visit) {
  for (int k = 0; k < 27; ++k) visit(BrickKey{key[0] + k % 3 - 1, key[1] + k / 3 % 3 - 1, key[2] + k / 9 - 1});
}

/// Whether a voxel of a brick lies in a changed brick, or within `reach` voxels of one (less than a brick's edge).
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

IncrementalSolver::BrickSummary IncrementalSolver::summarize(const FieldBrick& brick, float voxel_m) {
  BrickSummary summary;
  Eigen::Vector3i sum = Eigen::Vector3i::Zero();
  for (int i = 0; brick.color && i < kBrickVoxels; ++i) {
    if (!on_surface(brick, i, voxel_m)) continue;
    ++summary.count;
    summary.weight += brick.weight[i];
    summary.radiance += brick.radiance(static_cast<std::size_t>(i));
    sum += Eigen::Vector3i(i & 7, (i >> 3) & 7, i >> 6);
  }
  if (summary.count > 0) {
    summary.radiance /= summary.count;
    summary.centroid = sum.cast<float>() / summary.count;
  }
  return summary;
}

bool IncrementalSolver::BrickSummary::differs(const BrickSummary& other) const {
  return std::abs(count - other.count) > kIncremental.same_summary * std::max(count, other.count) + 1 ||
         (radiance - other.radiance).norm() >
             kIncremental.same_summary * std::max(radiance.norm(), other.radiance.norm()) ||
         (centroid - other.centroid).cwiseAbs().maxCoeff() > kIncremental.same_centroid_voxels;
}

void IncrementalSolver::keep(const DistanceField& field, const Surface& surface,
                             const std::vector<Eigen::Vector3f>& gathered, const std::vector<SampleAlbedo>& albedo,
                             const std::vector<PointAlbedo>& points, float noise_floor) {
  forget();
  voxel_m_ = field.voxel_m;
  sample_m_ = surface.sample_m;
  noise_floor_ = noise_floor;
  seen_ = field.bricks;
  for (const auto& [key, brick] : field.bricks) {
    const BrickSummary summary = summarize(*brick, field.voxel_m);
    if (summary.count == 0) continue;
    bricks_[key].summary = summary;
    count_ += summary.count;
    weight_ += summary.weight;
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

std::map<SampleCell, SampleAlbedo> IncrementalSolver::albedo() const {
  std::map<SampleCell, SampleAlbedo> result;
  for (const auto& [cell, sample] : samples_)
    if (sample.albedo.sigma >= 0) result.emplace_hint(result.end(), cell, sample.albedo);
  return result;
}

IncrementalSolver::Change IncrementalSolver::change(const DistanceField& field) const {
  Change change;
  change.points = count_;
  change.weight = weight_;
  std::set<BrickKey> others = incremental_;
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
    const BrickSummary now = summarize(*brick, field.voxel_m);
    change.weight += now.weight - (known == bricks_.end() ? 0 : known->second.summary.weight);
    if (known == bricks_.end() ? now.count > 0 : now.differs(known->second.summary))
      add(key, now.count, known == bricks_.end() ? 0 : known->second.summary.count);
  }
  for (const auto& [key, brick] : seen_) {
    if (field.brick(key)) continue;
    change.published.push_back(key);
    const auto known = bricks_.find(key);
    if (known == bricks_.end()) continue;
    change.weight -= known->second.summary.weight;
    add(key, 0, known->second.summary.count);
  }
  std::sort(change.bricks.begin(), change.bricks.end());
  change.fraction = static_cast<double>(others.size()) / std::max<double>(1, static_cast<double>(bricks_.size()));
  return change;
}

IncrementalSolver::Change IncrementalSolver::grown(const DistanceField& field) const {
  Change change;
  for (const auto& [key, brick] : field.bricks) {
    const auto seen = seen_.find(key);
    if (seen != seen_.end() && seen->second == brick) continue;
    const auto known = bricks_.find(key);
    const float before = known == bricks_.end() ? 0 : known->second.summary.count;
    if (summarize(*brick, field.voxel_m).count > (1 + kIncremental.same_summary) * before + 1)
      change.bricks.push_back(key);
  }
  std::sort(change.bricks.begin(), change.bricks.end());
  change.published = change.bricks;
  return change;
}

/// Reads the points of these bricks again; returns the cells of their old and new points.
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
    count_ -= brick.summary.count;
    weight_ -= brick.summary.weight;
    if (!field.brick(key)) {
      bricks_.erase(key);
      continue;
    }
    brick.summary = summarize(*field.brick(key), field.voxel_m);
    brick.points = points_in(field, key, rays, metal);
    brick.albedo.assign(brick.points.size(), {});
    count_ += brick.summary.count;
    weight_ += brick.summary.weight;
    touch(brick.points);
    if (brick.summary.count == 0) bricks_.erase(key);
  }
  return cells;
}

/// The changed bricks and all that may hold points of these cells.
std::set<BrickKey> IncrementalSolver::bricks_of(const std::set<SampleCell>& cells,
                                                const std::vector<BrickKey>& changed) const {
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
  return holding;
}

/// The samples of these cells, newly gathered and taken out of samples_, and after them those around them.
IncrementalSolver::Part IncrementalSolver::part_of(const std::set<SampleCell>& cells,
                                                   const std::vector<BrickKey>& changed, const Light& light) {
  // All points of these cells, of other bricks too.
  const std::set<BrickKey> holding = bricks_of(cells, changed);
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

  Part result;
  auto& [part, gathered, held] = result;
  part.sample_m = sample_m_;
  std::map<SampleCell, int> sample_of;
  std::map<SampleCell, Sample> before;
  for (const SampleCell& cell : cells)
    if (auto was = samples_.extract(cell)) before.insert(std::move(was));
  for (const auto& [cell, of_cell] : members) {
    SurfaceSample sample = patch(near, of_cell, cell, sample_m_);
    if (const auto was = before.find(cell); was != before.end()) sample.known = was->second.surface.known;
    const IrradianceModel::Gathered own = light.room.gather(sample.position, sample.normal, light.rays);
    gathered.push_back(gathered_light(light.room, own, light.floor_grid, sample));
    sample_of[cell] = static_cast<int>(part.samples.size());
    part.samples.push_back(sample);
    part.cells.push_back(cell);
  }
  const std::size_t open = part.samples.size();
  for (const auto& [cell, sample] : samples_) {
    const Eigen::Vector3f& position = sample.surface.position;
    const bool next_to = std::any_of(part.samples.begin(), part.samples.begin() + static_cast<std::ptrdiff_t>(open),
                                     [&](const SurfaceSample& own) {
                                       const float reach_m = kShadingParameters.samples.neighbour_reach * own.size_m;
                                       return (own.position - position).squaredNorm() < reach_m * reach_m;
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
      if (!point.metal) point.sample = sample_of.at(cell_of(point, sample_m_));
      part.points.push_back(point);
    }
  }
  return result;
}

/// Of a brick that changed, or that was measured again and is as before.
void IncrementalSolver::set_weight(const BrickKey& key, const FieldBrick& brick) {
  const auto known = bricks_.find(key);
  if (known == bricks_.end()) return;
  const float now = summarize(brick, voxel_m_).weight;
  weight_ += now - std::exchange(known->second.summary.weight, now);
}

std::size_t IncrementalSolver::solve(const DistanceField& field, const FieldRays& rays, const MetalMask& metal,
                                     const Light& light, const Change& change, BrickMap<AlbedoBrick>& bricks) {
  for (const BrickKey& key : change.published) {
    const auto now = field.bricks.find(key);
    if (now == field.bricks.end()) {
      seen_.erase(key);
    } else {
      seen_[key] = now->second;
      set_weight(key, *now->second);
    }
  }
  const std::vector<BrickKey>& changed = change.bricks;
  if (changed.empty()) return 0;
  incremental_.insert(changed.begin(), changed.end());
  const std::set<SampleCell> cells = refresh_points(field, rays, metal, changed);
  const auto [part, gathered, held] = part_of(cells, changed, light);
  const std::size_t open = part.samples.size() - held.size();

  const SurfaceLighting lit(part, light.room, light.illumination, gathered, noise_floor_, light.model_error, held);
  const std::vector<SampleAlbedo> albedo =
      solve_albedo(part.samples, lit.sample_light(), lit.neighbours(), noise_floor_, held);
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
  // A voxel within reach of a changed point may be nearer to an unchanged one: points within twice the reach matter.
  std::vector<SurfacePoint> points;
  std::vector<PointAlbedo> albedo;
  for (const BrickKey& key : written) {
    const auto brick = bricks_.find(key);
    if (brick == bricks_.end()) continue;
    const Near near(key, own, 2 * kReach);
    for (std::size_t i = 0; i < brick->second.points.size(); ++i) {
      if (!near(brick->second.points[i].index)) continue;
      points.push_back(brick->second.points[i]);
      albedo.push_back(brick->second.albedo[i]);
    }
  }
  const BrickMap<AlbedoBrick> reached = albedo_bricks(points, albedo);
  static const AlbedoBrick unknown = unknown_brick();
  BrickMap<AlbedoBrick> updated, before;
  for (const BrickKey& key : written) {
    const auto was = bricks.find(key);
    const auto now = reached.find(key);
    if (was == bricks.end() && now == reached.end()) continue;
    if (was != bricks.end()) before.emplace(key, was->second);
    const AlbedoBrick& from = now == reached.end() ? unknown : *now->second;
    auto brick = std::make_shared<AlbedoBrick>(was == bricks.end() ? unknown : *was->second);
    const Near near(key, own, kReach);
    for (int i = 0; i < kBrickVoxels; ++i) {
      if (!near(i)) continue;
      brick->albedo[i] = from.albedo[i];
      brick->sigma[i] = from.sigma[i];
    }
    updated.emplace(key, std::move(brick));
  }
  keep_unchanged(updated, before);
  for (const auto& [key, brick] : updated) {
    if (*std::max_element(brick->sigma.begin(), brick->sigma.end()) < 0) {
      bricks.erase(key);
    } else {
      bricks[key] = brick;
    }
  }
}

}  // namespace lumigraft::reconstruct
