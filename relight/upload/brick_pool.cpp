#include "relight/upload/brick_pool.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>
#include <utility>

#include "relight/upload/coarse_distance_grid.h"
#include "relight/upload/parameters.h"

namespace lumigraft::relight {
namespace {

constexpr std::size_t kVoxels = reconstruct::kBrickVoxels;

std::uint32_t half2(float a, float b) {
  return static_cast<std::uint32_t>(Eigen::half(a).x) | static_cast<std::uint32_t>(Eigen::half(b).x) << 16;
}

/// Rounds x >= 0 down to a half, so that a lower bound of distance stays one.
std::uint16_t half_below(float x) {
  const Eigen::half h(x);
  return static_cast<float>(h) > x ? static_cast<std::uint16_t>(h.x - 1) : h.x;
}

constexpr int kHalf = reconstruct::kBrickEdge / 2;  // voxels along a cell of the coarse distance grid

struct Slot {
  int number = 0;
  std::shared_ptr<const reconstruct::FieldBrick> field;
  std::shared_ptr<const reconstruct::AlbedoBrick> albedo;
  std::vector<LatticePoint> surface;  ///< surface point in each octant of the brick; cells are relative to the brick's
  bool used = false;
};

/// The mean surface point in each octant of a brick, weighted by a hat function of one voxel to either side.
std::vector<LatticePoint> surface_points(const reconstruct::BrickKey& key, const reconstruct::FieldBrick& brick,
                                         float voxel_m) {
  std::vector<LatticePoint> points;
  for (int eighth = 0; eighth < 8; ++eighth) {
    const Eigen::Vector3i cell(eighth & 1, eighth >> 1 & 1, eighth >> 2);
    Eigen::Vector3f sum = Eigen::Vector3f::Zero();
    float weights = 0;
    for (int i = 0; i < kHalf * kHalf * kHalf; ++i) {
      const Eigen::Vector3i at = kHalf * cell + Eigen::Vector3i(i % kHalf, i / kHalf % kHalf, i / (kHalf * kHalf));
      const auto k = static_cast<std::size_t>(reconstruct::index_in_brick(at));
      const float weight = brick.weight[k] > 0 ? 1 - std::abs(brick.distance_m[k]) / voxel_m : 0.0f;
      if (weight <= 0) continue;
      sum += weight * at.cast<float>();
      weights += weight;
    }
    if (weights == 0) continue;
    points.push_back({cell, voxel_m * (reconstruct::first_voxel(key).cast<float>() + sum / weights)});
  }
  return points;
}

/// First brick and number of bricks of a region, with one more on each side.
std::pair<Eigen::Vector3i, Eigen::Vector3i> bricks_of(const Eigen::AlignedBox3f& region, float brick_m) {
  const Eigen::Vector3i low = (region.min() / brick_m).array().floor().matrix().cast<int>() - Eigen::Vector3i::Ones();
  return {low, (region.max() / brick_m).array().floor().matrix().cast<int>() - low + Eigen::Vector3i::Constant(2)};
}

/// Large or distant objects may require more than a dense index can hold: then uses the known part of the field inside,
/// and of that the centre.
Eigen::AlignedBox3f held_of(Eigen::AlignedBox3f region, const reconstruct::DistanceField& field, float brick_m) {
  const auto fits = [&] { return bricks_of(region, brick_m).second.cast<double>().prod() <= kUpload.max_bricks; };
  if (fits()) return region;
  Eigen::AlignedBox3f known;
  for (const auto& [key, brick] : field.bricks) {
    const Eigen::Vector3f corner = brick_m * Eigen::Vector3i(key[0], key[1], key[2]).cast<float>();
    known.extend(corner);
    known.extend(corner + Eigen::Vector3f::Constant(brick_m));
  }
  const Eigen::Vector3f middle = region.center();
  const Eigen::AlignedBox3f within = region.intersection(known);
  region = within.isEmpty() ? Eigen::AlignedBox3f(middle, middle) : within;
  while (!fits()) region = {region.center() - 0.4f * region.sizes(), region.center() + 0.4f * region.sizes()};
  return region;
}

struct Range {  // of slots that were repacked
  std::size_t low = SIZE_MAX, high = 0;
  void add(std::size_t i) {
    low = std::min(low, i);
    high = std::max(high, i + 1);
  }
};

}  // namespace

struct BrickPool::State {
  gpu::Device& device;
  std::shared_ptr<const reconstruct::DistanceField> field;
  std::shared_ptr<const reconstruct::AlbedoField> albedo;
  Eigen::AlignedBox3f asked, region;            ///< region: the part of it that fits a dense index
  std::map<reconstruct::BrickKey, Slot> slots;  // ordered: uploaded data does not depend on hashing
  std::vector<int> free_slots;
  std::vector<std::uint32_t> distance, radiance, albedo_words;  // as in bricks.glsl
  Eigen::Vector3i low = Eigen::Vector3i::Zero(), size = Eigen::Vector3i::Ones();
  float voxel_m = 0.01f, truncation_m = 0.04f;
  std::unique_ptr<gpu::Buffer> index_buffer, clearance_buffer, distance_buffer, radiance_buffer, albedo_buffer;

  explicit State(gpu::Device& d) : device(d) {}

  void pack(const Slot& slot) {
    const std::size_t first = static_cast<std::size_t>(slot.number) * kVoxels;
    for (std::size_t i = 0; i < kVoxels; ++i) {
      const reconstruct::FieldBrick& b = *slot.field;
      const bool known = b.weight[i] > 0;
      distance[first + i] = half2(b.distance_m[i], known ? 1.0f : 0.0f);
      const bool seen = b.radiance_weight(i) > 0;
      const Eigen::Vector3f l = b.radiance(i);
      radiance[2 * (first + i)] = half2(l.x(), l.y());
      radiance[2 * (first + i) + 1] = half2(l.z(), seen ? 1.0f : 0.0f);
      const bool solved = slot.albedo && slot.albedo->sigma[i] >= 0;
      const Eigen::Vector3f a = solved ? slot.albedo->albedo[i] : Eigen::Vector3f::Zero();
      albedo_words[2 * (first + i)] = half2(a.x(), a.y());
      albedo_words[2 * (first + i) + 1] = half2(a.z(), solved ? 1.0f : 0.0f);
    }
  }

  /// Assigns slots to the bricks of the region; returns those that were packed.
  Range fill_slots() {
    for (auto& [key, slot] : slots) slot.used = false;
    const float brick_m = voxel_m * reconstruct::kBrickEdge;
    std::vector<Slot*> packed;
    for (const auto& [key, brick] : field->bricks) {
      const Eigen::Vector3f corner = brick_m * Eigen::Vector3i(key[0], key[1], key[2]).cast<float>();
      if (!region.intersects(Eigen::AlignedBox3f(corner, corner + Eigen::Vector3f::Constant(brick_m)))) continue;
      std::shared_ptr<const reconstruct::AlbedoBrick> colors;
      if (albedo && std::abs(albedo->voxel_m - field->voxel_m) < 1e-6f) {
        if (const auto found = albedo->bricks.find(key); found != albedo->bricks.end()) colors = found->second;
      }
      Slot& slot = slots[key];
      slot.used = true;
      if (slot.field == brick && slot.albedo == colors) continue;
      if (!slot.field) slot.number = -1;
      slot.field = brick;
      slot.albedo = colors;
      slot.surface = surface_points(key, *brick, voxel_m);
      packed.push_back(&slot);
    }
    std::erase_if(slots, [&](const auto& entry) {
      if (!entry.second.used) free_slots.push_back(entry.second.number);
      return !entry.second.used;
    });
    Range range;
    for (Slot* slot : packed) {
      if (slot->number < 0) {
        if (free_slots.empty()) {
          slot->number = static_cast<int>(distance.size() / kVoxels);
          distance.resize(distance.size() + kVoxels);
          radiance.resize(radiance.size() + 2 * kVoxels);
          albedo_words.resize(albedo_words.size() + 2 * kVoxels);
        } else {
          slot->number = free_slots.back();
          free_slots.pop_back();
        }
      }
      range.add(static_cast<std::size_t>(slot->number));
      pack(*slot);
    }
    return range;
  }

  /// As bricks.glsl reads them, two per word.
  std::vector<std::uint32_t> clearances() const {
    std::vector<LatticePoint> points;
    for (const auto& [key, slot] : slots) {
      const Eigen::Vector3i first = 2 * (Eigen::Vector3i(key[0], key[1], key[2]) - low);
      for (const LatticePoint& p : slot.surface) points.push_back({first + p.cell, p.position_m});
    }
    // Voxel positions are their centres: the lowest cell begins half a voxel before.
    const Eigen::Vector3f corner_m =
        voxel_m * (reconstruct::kBrickEdge * low.cast<float>() - Eigen::Vector3f::Constant(0.5f));
    const std::vector<float> metres = lattice_distances(points, 2 * size, corner_m, kHalf * voxel_m, kUpload.far_m);
    std::vector<std::uint32_t> words((metres.size() + 1) / 2);
    for (std::size_t i = 0; i < metres.size(); ++i) {
      words[i / 2] |= static_cast<std::uint32_t>(half_below(metres[i])) << 16 * (i % 2);
    }
    return words;
  }

  std::size_t cell(const reconstruct::BrickKey& key) const {
    return static_cast<std::size_t>((key[0] - low.x()) +
                                    size.x() * ((key[1] - low.y()) + size.y() * (key[2] - low.z())));
  }

  template <typename T>
  void send(std::unique_ptr<gpu::Buffer>& buffer, const std::vector<T>& values, std::size_t from, std::size_t to,
            const char* name) {
    const std::size_t bytes = std::max<std::size_t>(values.size(), 1) * sizeof(T);
    if (!buffer || buffer->size_bytes() < bytes) {
      buffer.reset();  // all of it is uploaded again
      buffer = device.create_buffer(bytes + bytes / 4 / 16 * 16, name);
      from = 0;
      to = values.size();
    }
    if (from < to) device.upload(*buffer, from * sizeof(T), std::as_bytes(std::span(values).subspan(from, to - from)));
  }

  void send_index() {
    std::vector<int> index(static_cast<std::size_t>(size.prod()), -1);
    for (const auto& [key, slot] : slots) index[cell(key)] = slot.number;
    send(index_buffer, index, 0, index.size(), "brick index");
    const std::vector<std::uint32_t> clear = clearances();
    send(clearance_buffer, clear, 0, clear.size(), "brick clearance");
  }

  void send_bricks(const Range& range) {
    const std::size_t low_voxel = range.low < range.high ? range.low * kVoxels : 0, high_voxel = range.high * kVoxels;
    send(distance_buffer, distance, low_voxel, high_voxel, "brick distance");
    send(radiance_buffer, radiance, 2 * low_voxel, 2 * high_voxel, "brick radiance");
    send(albedo_buffer, albedo_words, 2 * low_voxel, 2 * high_voxel, "brick albedo");
  }
};

BrickPool::BrickPool(gpu::Device& device) : state_(std::make_unique<State>(device)) {
  state_->send_index();
  state_->send_bricks({});
}
BrickPool::~BrickPool() = default;

bool BrickPool::update(const std::shared_ptr<const reconstruct::DistanceField>& field,
                       const std::shared_ptr<const reconstruct::AlbedoField>& albedo,
                       const Eigen::AlignedBox3f& region) {
  State& s = *state_;
  if (s.field == field && s.albedo == albedo && s.asked.isApprox(region, 1e-6f)) return false;
  if (s.voxel_m != field->voxel_m) {  // a different grid: nothing can be reused
    s.slots.clear();
    s.free_slots.clear();
    s.distance.clear();
    s.radiance.clear();
    s.albedo_words.clear();
  }
  s.field = field;
  s.albedo = albedo;
  s.asked = region;
  s.region = held_of(region, *field, field->voxel_m * reconstruct::kBrickEdge);
  s.voxel_m = field->voxel_m;
  s.truncation_m = field->truncation_m;
  const Range range = s.fill_slots();
  std::tie(s.low, s.size) = bricks_of(s.region, s.voxel_m * reconstruct::kBrickEdge);
  s.send_index();
  s.send_bricks(range);
  return true;
}

void BrickPool::describe(shader::FrameParams& params) const {
  params.bricks_low << state_->low, 0;
  params.bricks_size << state_->size, state_->slots.empty() ? 0 : 1;
  params.field.x() = state_->voxel_m;
  params.field.y() = state_->truncation_m;
}

std::vector<gpu::Binding> BrickPool::distance_bindings() const {
  return {gpu::storage(20, *state_->index_buffer), gpu::storage(21, *state_->clearance_buffer),
          gpu::storage(22, *state_->distance_buffer)};
}

std::vector<gpu::Binding> BrickPool::bindings() const {
  std::vector<gpu::Binding> all = distance_bindings();
  all.push_back(gpu::storage(23, *state_->radiance_buffer));
  all.push_back(gpu::storage(24, *state_->albedo_buffer));
  return all;
}

}  // namespace lumigraft::relight
