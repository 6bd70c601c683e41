#pragma once
// Albedo that an earlier run of the program solved and kept: what is known of surface that this run has not seen yet.
// It is no evidence for solutions of what this run sees: its errors are those of lamps that were misplaced then, and in
// the same light, as after most restarts, they would be misplaced farther.
#include <memory>
#include <unordered_map>
#include <utility>

#include "reconstruct/albedo/albedo.h"
#include "reconstruct/shading/surface_samples.h"

namespace lumigraft::reconstruct {

/// 1σ of the errors that all albedos solved in this light have in common, relative: of the fish-eye, and of the power
/// of clipped lamps.
float common_error(const Illumination& light);

/// 1σ of an albedo in later, other light: with what is common to all, and as surfaces change.
float sigma_later(const SampleAlbedo& solved, float common_error);

/// Completes solutions by kept albedo where they know none.
class KeptAlbedo {
 public:
  explicit KeptAlbedo(std::shared_ptr<const AlbedoField> kept) : kept_(std::move(kept)) {}
  /// Bricks that did not change since the last call are the same pointers. Null: nothing is solved yet.
  std::shared_ptr<const AlbedoField> complete(const std::shared_ptr<const AlbedoField>& solved);

 private:
  struct Completed {
    std::shared_ptr<const AlbedoBrick> solved, result;
  };
  std::shared_ptr<const AlbedoField> kept_;
  std::unordered_map<BrickKey, Completed, BrickKeyHash> completed_;  ///< of bricks that both know
};

}  // namespace lumigraft::reconstruct
