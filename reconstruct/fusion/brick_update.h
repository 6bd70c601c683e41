#pragma once
// Updates bricks from one depth image and its colour image: a row of eight voxels at a time, except voxels near a jump
// in depth or outside the image, which are updated one by one.
#include <Eigen/Geometry>

#include "reconstruct/fusion/brick_selection.h"
#include "reconstruct/fusion/depth_preprocess.h"
#include "reconstruct/fusion/image_lookup.h"
#include "reconstruct/fusion/working_brick.h"

namespace lumigraft::reconstruct {

class BrickUpdate {
 public:
  struct Sizes {
    float voxel_m, truncation_m, weight_cap;
  };
  /// Keeps references to all arguments except `sizes`. `wide` false: without vectors of eight floats, as on processors
  /// that lack them; the result is bit-identical.
  BrickUpdate(const PreparedDepth& view, const DepthPreprocessor& preprocessor, const PixelMap& map,
              const ColorLookup& colour, const Eigen::Isometry3f& T_camera_tag, const Sizes& sizes, bool wide = true);

  /// What an update changed.
  struct Change {
    bool observed = false;     ///< at least one voxel was
    int moved_voxels = 0;      ///< known voxels whose distance differs by more than the truncation distance
    int new_voxels = 0;        ///< voxels that were unknown
    int rows = 0;              ///< of eight voxels of which one was observed
    bool solid = false;        ///< one of those has a voxel behind a surface
    bool new_color = false;    ///< a voxel got its first colour, or a channel of it
    float drift = 0;           ///< RMS change of distance, relative to the allowed drift (PublicationParameters)
    float radiance_drift = 0;  ///< root of the summed squared changes of radiance
  };
  /// Updates a brick of which everything deeper than `hidden_m` is hidden. If the image shows nothing of it, it stays
  /// as it is: it is not copied for a change.
  Change update(WorkingBrick& brick, float hidden_m, const FieldBrickMaker& maker) const;
  /// Prefetches what `update` of this brick reads.
  void prefetch(const WorkingBrick& brick, const BrickVisibility& visibility) const;
  /// Updates a brick in open space: all of it is free. No change if that is known.
  Change update_open(WorkingBrick& brick, const FieldBrickMaker& maker) const;

 private:
  struct Row;
  struct Readings;
  struct Conflict;
  struct DriftSum;
  Change update_rows(WorkingBrick& brick, float hidden_m, const FieldBrickMaker& maker) const;
  Change update_wide(WorkingBrick& brick, float hidden_m, const FieldBrickMaker& maker) const;
  Readings read(const Row& at) const;
  Conflict conflict(const FieldBrick& brick, std::size_t i, const Readings& readings) const;
  void fuse(FieldBrick& brick, std::size_t i, const Readings& readings, Change& change, DriftSum& drift) const;
  bool from_other_side(const FieldBrick& brick, std::size_t i, const Eigen::Vector3f& normal) const;
  void fuse_color(WorkingBrick& brick, std::size_t i, float u, float v, bool nearest, float weight,
                  const FieldBrickMaker& maker, Change& change) const;

  const PreparedDepth& view_;
  const PixelMap& map_;
  const ColorLookup& colour_;
  const Eigen::Isometry3f& T_camera_tag_;
  Sizes sizes_;
  float shell_m_, overrule_m_, end_u_, end_v_, near_m_, per_near_square_, per_away_square_;
  DepthLookup depth_;
  bool wide_;
};

}  // namespace lumigraft::reconstruct
