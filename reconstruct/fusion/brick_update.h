#pragma once
// One depth picture, and what colour shows, into bricks: a row of eight voxels at a time, but for voxels beside jumps
// in depth or beside the picture.
#include <Eigen/Geometry>

#include "reconstruct/fusion/brick_selection.h"
#include "reconstruct/fusion/color_lookup.h"
#include "reconstruct/fusion/depth_lookup.h"
#include "reconstruct/fusion/depth_preprocess.h"
#include "reconstruct/fusion/working_brick.h"

namespace lumigraft::reconstruct {

class BrickUpdate {
 public:
  struct Sizes {
    float voxel_m, truncation_m, weight_cap;
  };
  /// All but `sizes` are kept by reference. Not `wide`: as a processor works that has no vectors of eight; the result
  /// is the same, to the bit.
  BrickUpdate(const PreparedDepth& view, const DepthPreparation& preparation, const PixelMap& map,
              const ColorLookup& colour, const Eigen::Isometry3f& T_camera_tag, const Sizes& sizes, bool wide = true);

  struct Told {
    bool any = false;
    int moved = 0;             ///< voxels that were far from where the picture shows them
    int learnt = 0;            ///< voxels that were unknown
    bool coloured = false;     ///< one that had no colour has
    float drift = 0;           ///< root mean square of what changed, over what a brick may drift
    float radiance_drift = 0;  ///< root of the sum of squares
  };
  /// What of a known brick may wait for a later look.
  enum class Wait {
    nothing,
    free,            ///< rows that were free take turns
    free_and_silent  ///< and rows of which nothing was told: for a camera that has not moved
  };
  /// Of a brick of which nothing is seen from the depth `hidden_m` on.
  Told update(WorkingBrick& brick, float hidden_m, Wait wait) const;
  /// To be called some time before `update` of the brick.
  void fetch(const WorkingBrick& brick, const Sight& sight) const;
  /// Of a brick in front of everything: free space. Nothing is told where that was known.
  Told clear(WorkingBrick& brick) const;

 private:
  struct Row;
  struct Readings;
  struct Conflict;
  struct Squares;
  Told update_rows(WorkingBrick& brick, float hidden_m, Wait wait) const;
  Told update_wide(WorkingBrick& brick, float hidden_m, Wait wait) const;
  Readings read(const Row& at) const;
  Conflict conflict(const FieldBrick& brick, std::size_t i, const Readings& readings) const;
  void fuse(FieldBrick& brick, std::size_t i, const Readings& readings, Told& told, Squares& squares) const;
  bool from_other_side(const FieldBrick& brick, std::size_t i, const Eigen::Vector3f& normal) const;
  void colour(FieldBrick& brick, std::size_t i, float u, float v, bool nearest, float share, Told& told) const;

  const PreparedDepth& view_;
  const PixelMap& map_;
  const ColorLookup& colour_;
  const Eigen::Isometry3f& T_camera_tag_;
  Sizes sizes_;
  float shell_m_, denies_m_, end_u_, end_v_, near_m_, per_near_square_, per_away_square_;
  DepthReader depth_;
  bool wide_;
};

}  // namespace lumigraft::reconstruct
