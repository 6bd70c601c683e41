#pragma once
// A brick in progress, and its published copy.
#include <cstdint>
#include <memory>
#include <vector>

#include "reconstruct/field/distance_field.h"
#include "reconstruct/fusion/brick_pages.h"

namespace lumigraft::reconstruct {

struct SurfaceBrick;

struct WorkingBrick {
  // The fields read for every brick in every frame come first, close together.
  BrickKey key{};
  std::uint32_t update_count = 0;  ///< frames that observed it
  std::uint32_t last_update = 0;   ///< the last of them
  std::uint32_t active_until = 0;  ///< update_count up to which it is updated in every frame
  std::uint32_t row_turn = 0;      ///< counts updates, also those that observed nothing
  /// One bit per row y + 8 z, from the last update of the row.
  std::uint64_t free_rows = 0;        ///< all voxels observed as free, and free before
  std::uint64_t unobserved_rows = 0;  ///< no voxel observed
  bool open = false;                  ///< every voxel is known to be free, far from surfaces
  bool queued = false;                ///< to be published if it has drifted
  bool urgent = false;                ///< to be published at once
  bool copied = false;                ///< `published` is newer than the field's

  /// Upper bounds of the drift since the last publication: of distance, relative to the allowed drift, and of radiance.
  /// Changes are added up, since a comparison with the published brick costs as much as an update.
  float drift = kDriftUnknown, radiance_drift = 0, max_radiance_drift = 0;
  static constexpr float kDriftUnknown = 1e9f;

  double light_variance = 0;  ///< FusionStage::State::light_variance at its last update

  std::shared_ptr<const FieldBrick> published;
  std::shared_ptr<const SurfaceBrick> model;  ///< of real surfaces in it; null if there are none
  alignas(64) FieldBrick now;                 ///< aligned, so that a row is in one cache line

  /// Adds `variance` (relative, 1σ²) to that of the radiance, by lowering its weights.
  void forget_radiance(double variance);
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

/// All bricks in the order of their creation, at stable addresses. Access jumps through megabytes: huge pages save a
/// tenth of fusion's time.
class WorkingBricks {
 public:
  WorkingBricks() = default;
  WorkingBricks(const WorkingBricks&) = delete;
  WorkingBricks& operator=(const WorkingBricks&) = delete;
  ~WorkingBricks();

  WorkingBrick& add();
  WorkingBrick& operator[](std::size_t i) { return pages_[i / kInPage].get()[i % kInPage]; }
  std::size_t size() const { return size_; }

 private:
  static constexpr std::size_t kInPage = kPage_bytes / sizeof(WorkingBrick);
  std::vector<std::unique_ptr<WorkingBrick, FreePage>> pages_;
  std::size_t size_ = 0;  ///< bricks that live
};

}  // namespace lumigraft::reconstruct
