#include "reconstruct/albedo/shadow_carving.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <unordered_set>

#include "reconstruct/albedo/parameters.h"

namespace lumigraft::reconstruct {
namespace {

using State = ObservedShadow::State;
using Eigen::Vector3f;

constexpr const AlbedoParameters::Carving& kCarving = kAlbedoParameters.carving;

/// Samples by position.
class SampleGrid {
 public:
  explicit SampleGrid(const std::vector<SurfaceSample>& samples) : samples_(samples) {
    for (const SurfaceSample& sample : samples) cell_m_ = std::max(cell_m_, kCarving.sample_reach * sample.size_m);
    for (std::size_t i = 0; i < samples.size(); ++i) cells_[cell_of(samples[i].position)].push_back(i);
  }
  /// The nearest sample whose patch may contain the point; -1: none.
  int nearest(const Vector3f& position_m) const {
    int best = -1;
    float min_square = std::numeric_limits<float>::infinity();
    const BrickKey key = cell_of(position_m);
    for (int k = 0; k < 27; ++k) {
      const auto cell = cells_.find({key[0] + k % 3 - 1, key[1] + k / 3 % 3 - 1, key[2] + k / 9 - 1});
      if (cell == cells_.end()) continue;
      for (const std::size_t i : cell->second) {
        const float square = (samples_[i].position - position_m).squaredNorm();
        const float reach_m = kCarving.sample_reach * samples_[i].size_m;
        if (square > std::min(min_square, reach_m * reach_m)) continue;
        min_square = square;
        best = static_cast<int>(i);
      }
    }
    return best;
  }

 private:
  BrickKey cell_of(const Vector3f& p) const {
    const Eigen::Vector3i cell = (p / cell_m_).array().floor().cast<int>();
    return {cell.x(), cell.y(), cell.z()};
  }
  const std::vector<SurfaceSample>& samples_;
  float cell_m_ = 1e-3f;
  std::unordered_map<BrickKey, std::vector<std::size_t>, BrickKeyHash> cells_;
};

Vector3f towards_lamp(const PointLight& lamp, const Vector3f& from_m) {
  return lamp.distance_known ? (lamp.position_m - from_m).normalized() : lamp.direction;
}

class Carver {
 public:
  Carver(const DistanceField& field, const FieldRays& rays, const std::vector<SurfaceSample>& samples,
         const std::vector<ObservedShadow>& shadows)
      : field_(field), rays_(rays), samples_(samples), shadows_(shadows), grid_(samples) {}

  BrickMap<FieldBrick> carve() {
    for (const ObservedShadow& shadow : shadows_)
      for (std::size_t i = 0; i < samples_.size(); ++i)
        if (shadow.samples[i] == State::dark) add_candidates(shadow.lamp, samples_[i]);
    std::vector<Eigen::Vector3i> solid;
    for (const BrickKey& key : candidates_) {
      std::vector<int> hidden;
      bool any_dark = false;
      for (int i = 0; i < kBrickVoxels; ++i) {
        const std::optional<State> state = state_of(voxel_in(key, i));
        if (state && *state != State::lit) hidden.push_back(i);
        any_dark |= state == State::dark;
      }
      for (const int i : hidden)
        if (any_dark) solid.push_back(voxel_in(key, i));
    }
    for (const Eigen::Vector3i& voxel : solid) put(voxel, -0.5f);
    spread(solid);
    BrickMap<FieldBrick> result;
    for (auto& [key, brick] : bricks_) result.emplace(key, std::move(brick));
    return result;
  }

 private:
  /// Bricks that hold hidden space between a dark sample and its lamp.
  void add_candidates(const PointLight& lamp, const SurfaceSample& sample) {
    const Vector3f direction = towards_lamp(lamp, sample.position);
    const float end_m =
        lamp.distance_known ? (lamp.position_m - sample.position).norm() - 2 * lamp.radius_m : kCarving.far_m;
    for (float t = kCarving.lift_voxels * field_.voxel_m; t < std::min(end_m, kCarving.far_m); t += field_.voxel_m) {
      const Vector3f at = sample.position + t * direction;
      const BrickKey key = brick_of((at / field_.voxel_m).array().round().cast<int>().matrix());
      if (!candidates_.contains(key) && hidden_from_all(field_.seen_space, at)) candidates_.insert(key);
    }
  }

  /// Lit if a lamp's line through the voxel ends at a lit sample, else dark if one ends at a dark sample. Empty for a
  /// voxel that was observed.
  std::optional<State> state_of(const Eigen::Vector3i& voxel) const {
    const FieldBrick* known = field_.brick(brick_of(voxel));
    if (known && known->weight[static_cast<std::size_t>(index_in_brick(voxel))] > 0) return std::nullopt;
    const Vector3f at = field_.voxel_m * voxel.cast<float>();
    if (!hidden_from_all(field_.seen_space, at)) return std::nullopt;
    State result = State::unknown;
    for (const ObservedShadow& shadow : shadows_) {
      const auto end = rays_.first_crossing(at, -towards_lamp(shadow.lamp, at), kCarving.far_m);
      const int sample = end ? grid_.nearest(*end) : -1;
      if (sample < 0) continue;
      const State state = shadow.samples[static_cast<std::size_t>(sample)];
      if (state == State::lit) return State::lit;
      if (state == State::dark) result = State::dark;
    }
    return result;
  }

  /// Distances around solid voxels, layer by layer. They are never too long, so that rays do not step over thin ones.
  void spread(std::vector<Eigen::Vector3i> layer) {
    const float last = std::ceil(field_.truncation_m / field_.voxel_m);
    for (float distance_voxels = -0.5f; !layer.empty(); ++distance_voxels) {
      std::vector<Eigen::Vector3i> next;
      for (const Eigen::Vector3i& voxel : layer)
        for (int k = 0; k < 27 && distance_voxels + 1 < last; ++k) {
          const Eigen::Vector3i neighbour = voxel + Eigen::Vector3i(k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1);
          if (put(neighbour, distance_voxels + 1)) next.push_back(neighbour);
        }
      layer = std::move(next);
    }
  }

  /// Whether the voxel had no distance before.
  bool put(const Eigen::Vector3i& voxel, float distance_voxels) {
    std::shared_ptr<FieldBrick>& brick = bricks_[brick_of(voxel)];
    if (!brick) brick = std::make_shared<FieldBrick>();
    const auto i = static_cast<std::size_t>(index_in_brick(voxel));
    if (brick->weight[i] > 0) return false;
    brick->weight[i] = kCarving.weight;
    brick->distance_m[i] = distance_voxels * field_.voxel_m;
    return true;
  }

  const DistanceField& field_;
  const FieldRays& rays_;
  const std::vector<SurfaceSample>& samples_;
  const std::vector<ObservedShadow>& shadows_;
  SampleGrid grid_;
  std::unordered_set<BrickKey, BrickKeyHash> candidates_;
  std::unordered_map<BrickKey, std::shared_ptr<FieldBrick>, BrickKeyHash> bricks_;
};

/// `field`: null if it has no such brick.
std::shared_ptr<const FieldBrick> merge_brick(const FieldBrick* field, const FieldBrick& occluder, float voxel_m) {
  auto result = field ? std::make_shared<FieldBrick>(*field) : std::make_shared<FieldBrick>();
  for (std::size_t i = 0; i < kBrickVoxels; ++i) {
    const bool known = result->weight[i] > 0;
    // Of unknown space only the solid and what is next to it become known.
    if (!(occluder.weight[i] > 0) || (known ? result->distance_m[i] : voxel_m) <= occluder.distance_m[i]) continue;
    if (!known) result->weight[i] = occluder.weight[i];
    result->distance_m[i] = occluder.distance_m[i];
  }
  return result;
}

}  // namespace

BrickMap<FieldBrick> carve_occluders(const DistanceField& field, const FieldRays& rays,
                                     const std::vector<SurfaceSample>& samples,
                                     const std::vector<ObservedShadow>& shadows) {
  return Carver(field, rays, samples, shadows).carve();
}

std::shared_ptr<const DistanceField> OccluderMerge::merged(
    const std::shared_ptr<const DistanceField>& field, const std::shared_ptr<const BrickMap<FieldBrick>>& occluders) {
  if (!field || !occluders || occluders->empty()) return field;
  if (field == field_ && occluders == occluders_) return result_;
  if (occluders != occluders_) ++occluders_version_;
  auto result = std::make_shared<DistanceField>(*field);
  result->occluders_version = occluders_version_ << 32 | field->occluders_version;
  std::erase_if(cache_, [&](const auto& entry) { return !occluders->contains(entry.first); });
  for (const auto& [key, occluder] : *occluders) {
    const auto entry = field->bricks.find(key);
    const std::shared_ptr<const FieldBrick> known = entry == field->bricks.end() ? nullptr : entry->second;
    Merged& merged = cache_[key];
    if (!merged.result || merged.field != known || merged.occluder != occluder)
      merged = {known, occluder, merge_brick(known.get(), *occluder, field->voxel_m)};
    result->bricks[key] = merged.result;
  }
  field_ = field;
  occluders_ = occluders;
  result_ = std::move(result);
  return result_;
}

}  // namespace lumigraft::reconstruct
