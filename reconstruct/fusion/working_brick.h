#pragma once
// A brick in progress, and its published copy.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <unordered_map>
#include <utility>
#include <vector>

#include "reconstruct/field/distance_field.h"
#include "reconstruct/fusion/brick_pages.h"

namespace lumigraft::reconstruct {

struct SurfaceBrick;

struct WorkingBrick {
  BrickKey key{};
  std::uint32_t turn = 0;          ///< its number in the order of creation, so that not all are due in the same frame
  std::uint32_t update_count = 0;  ///< frames in which it was updated
  std::uint32_t last_update = 0;   ///< the last of them, or the frame that created it
  std::uint32_t misses = 0;        ///< the last so many of them observed nothing of it
  std::uint32_t active_until = 0;  ///< update_count up to which it is updated in every frame
  bool open = false;               ///< every voxel is known to be free, far from surfaces
  bool solid = false;              ///< a voxel may be behind a surface
  bool queued = false;             ///< to be published if it has drifted
  bool urgent = false;             ///< to be published at once
  bool copied = false;             ///< `published` is newer than the field's

  /// Upper bounds of the drift since the last publication: of distance, relative to the allowed drift, and of radiance.
  /// Changes are added up, since a comparison with the published brick costs as much as an update.
  float drift = kDriftUnknown, radiance_drift = 0, max_radiance_drift = 0;
  static constexpr float kDriftUnknown = 1e9f;

  double light_variance = 0;  ///< FusionStage::State::light_variance at its last update

  std::shared_ptr<FieldBrick> now;                ///< null before the first update; the published one if equal to it
  std::shared_ptr<FieldBrick> published;          ///< not changed any more; null before the first publication
  std::shared_ptr<BrickColor> unpublished_color;  ///< that of `now`, while no published brick shares it; null otherwise
  bool published_color = false;                   ///< `published` has colour
  std::shared_ptr<const SurfaceBrick> model;      ///< of real surfaces in it; null if there are none

  /// Whether a voxel has colour.
  bool has_color() const;
  /// Memory of `now`, of `published` and of their colours.
  std::size_t bytes() const {
    return FieldBrickMaker::kBrick_bytes * ((now ? 1u : 0u) + (published && published != now ? 1u : 0u)) +
           FieldBrickMaker::kColor_bytes * ((unpublished_color ? 1u : 0u) + (published_color ? 1u : 0u));
  }
  /// To be called before `now` is changed: copies it if it is published, creates it if there is none.
  void prepare_change(const FieldBrickMaker& maker) {
    if (!now || now == published) now = now ? maker.copy(*now) : maker.make();
  }
  /// To be called after prepare_change, and before the colour of `now` is changed.
  BrickColor& prepare_color(const FieldBrickMaker& maker) {
    if (!unpublished_color) now->color = unpublished_color = maker.copy(now->color.get());
    return *unpublished_color;
  }
  void publish(std::shared_ptr<FieldBrick> brick) {
    published = std::move(brick);
    published_color = published->color != nullptr;
    unpublished_color = nullptr;
  }
  /// Forgets what changed since the last publication.
  void revert() {
    now = published;
    unpublished_color = nullptr;
  }
  /// Adds the drift of an update. `more_known`: distance or colour of a voxel became known.
  void add_drift(bool more_known, float update_drift, float update_radiance_drift) {
    drift = more_known ? kDriftUnknown : drift + update_drift;
    radiance_drift += update_radiance_drift;
  }
  bool may_have_drifted() const { return drift >= 1 || radiance_drift >= max_radiance_drift; }
  /// Whether `next` differs from the published brick by more than PublicationParameters allow (RMS distance or radiance
  /// over the brick, noise excepted), or a voxel became known. If not, stores the drift.
  bool drifted(const FieldBrick& next, float voxel_m);
};

/// All bricks, at stable addresses.
class WorkingBricks {
 public:
  /// Creates the brick if there is none.
  WorkingBrick& at(const BrickKey& key);
  std::size_t size() const { return bricks_.size(); }
  auto begin() const { return bricks_.begin(); }
  auto end() const { return bricks_.end(); }
  /// Calls `visit` with each brick. Faster than a loop from begin to end: there are tens of thousands of bricks, more
  /// than the cache holds.
  template <typename Visit>
  void for_each(const Visit& visit) const {
    constexpr std::size_t kAhead = 16, kLine = 64;  // bricks; bytes
    for (std::size_t i = 0; i < bricks_.size(); ++i) {
      const auto* next = reinterpret_cast<const std::byte*>(bricks_[std::min(i + kAhead, bricks_.size() - 1)].get());
      __builtin_prefetch(next);
      __builtin_prefetch(next + kLine);
      visit(*bricks_[i]);
    }
  }
  /// Removes the bricks for which `evicted(brick)` is true.
  template <typename Evicted>
  void remove_if(const Evicted& evicted) {
    std::erase_if(bricks_, [&](const std::unique_ptr<WorkingBrick>& brick) {
      const bool gone = evicted(*brick);
      if (gone) by_key_.erase(brick->key);
      return gone;
    });
  }

 private:
  std::vector<std::unique_ptr<WorkingBrick>> bricks_;  ///< in the order of their creation
  std::unordered_map<BrickKey, WorkingBrick*, BrickKeyHash> by_key_;
  std::uint32_t created_ = 0;
};

}  // namespace lumigraft::reconstruct
