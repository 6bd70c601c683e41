#pragma once
// A brick that is being worked on, and what of it was published.
#include <cstdint>
#include <cstdlib>
#include <memory>
#include <vector>

#include "reconstruct/field/distance_field.h"

namespace lumigraft::reconstruct {

struct SurfaceBrick;

/// What a brick may be away from what was published, root mean square over its voxels: of a voxel, near surfaces and
/// away from them; and of its radiance.
constexpr float kDriftNearShare = 0.02f, kDriftAwayShare = 0.1f, kDriftNearVoxels = 2, kDriftRadianceShare = 0.01f;
/// Voxels more that count as near in a bound: what crosses them has drifted.
constexpr float kDriftMargin = 0.5f;

struct WorkingBrick {
  // What is asked of every brick in every picture lies together, before what few need.
  BrickKey key{};
  std::uint32_t update_count = 0;  ///< pictures that said something about it
  std::uint32_t last_look = 0;     ///< picture that was the last of them
  std::uint32_t active_until = 0;  ///< look, while what is there seems to change
  std::uint32_t turn = 0;          ///< counts looks, whether they told anything or not
  /// By row, y + 8 z: what the last look at it found.
  std::uint64_t free_rows = 0;        ///< free, and known to be, all along
  std::uint64_t unobserved_rows = 0;  ///< nothing told
  bool open = false;                  ///< every voxel is known to be free, far from surfaces
  bool waiting = false;               ///< to be published, if it drifted
  bool urgent = false;                ///< at once
  bool renewed = false;               ///< `published` is not in the field yet

  /// Drift since what was published at most, over what it may be; and of radiance, in its units. What a look changes is
  /// added up, since looking at both fields costs as much as a look.
  float drift = kDriftUnknown, radiance_drift = 0, most_radiance_drift = 0;
  static constexpr float kDriftUnknown = 1e9f;

  std::shared_ptr<const FieldBrick> published;
  std::shared_ptr<const SurfaceBrick> model;  ///< of real surfaces in it; null without
  alignas(64) FieldBrick now;                 ///< a row never in two lines of the cache

  /// After a look. `more_known`: distance or colour of a voxel.
  void add_drift(bool more_known, float look_drift, float look_radiance_drift) {
    drift = more_known ? kDriftUnknown : drift + look_drift;
    radiance_drift += look_radiance_drift;
  }
  bool may_have_drifted() const { return drift >= 1 || radiance_drift >= most_radiance_drift; }
  /// Whether `next` is away from what was published by more than 2 % of a voxel (10 % away from surfaces), root mean
  /// square over the brick, or half of what noise leaves uncertain where that is more; or by 1 % of radiance; or a
  /// voxel became known. If not, remembers by how much it is.
  bool drifted(const FieldBrick& next, float voxel_m);
};

/// All of them, in the order in which they came, where they stay. They are megabytes that are gone through in leaps:
/// huge pages spare a tenth of fusion's time.
class WorkingBricks {
 public:
  WorkingBricks() = default;
  WorkingBricks(const WorkingBricks&) = delete;
  WorkingBricks& operator=(const WorkingBricks&) = delete;
  ~WorkingBricks() { clear(); }

  WorkingBrick& add();
  WorkingBrick& operator[](std::size_t i) { return chunks_[i / kInChunk].get()[i % kInChunk]; }
  std::size_t size() const { return size_; }
  void clear();

 private:
  static constexpr std::size_t kChunk_bytes = std::size_t{2} << 20, kInChunk = kChunk_bytes / sizeof(WorkingBrick);
  struct Free {
    void operator()(WorkingBrick* chunk) const { std::free(chunk); }
  };
  std::vector<std::unique_ptr<WorkingBrick, Free>> chunks_;
  std::size_t size_ = 0;  ///< bricks that live
};

}  // namespace lumigraft::reconstruct
