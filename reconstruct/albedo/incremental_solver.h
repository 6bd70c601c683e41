#pragma once
// What solves of albedo found, kept so that later ones need look only at what is new or changed.
#include <Eigen/Core>
#include <cstddef>
#include <map>
#include <set>
#include <unordered_map>
#include <vector>

#include "reconstruct/albedo/albedo_bricks.h"
#include "reconstruct/albedo/surface_points.h"
#include "reconstruct/field/metal_mask.h"
#include "reconstruct/shading/irradiance.h"
#include "reconstruct/shading/surface_samples.h"

namespace lumigraft::reconstruct {

class IncrementalSolver {
 public:
  /// After a solve of everything. `gathered`, `albedo` by sample, `points` by point.
  void keep(const DistanceField& field, const Surface& surface, const std::vector<Eigen::Vector3f>& gathered,
            const std::vector<SampleAlbedo>& albedo, const std::vector<PointAlbedo>& points, float dark);
  void forget() { *this = {}; }

  struct Change {
    std::vector<BrickKey> bricks;  ///< whose surface is new, gone, elsewhere, or of another radiance than when solved
    double points = 0;             ///< surface points of the whole field, about
    double share = 0;  ///< of the bricks with surface: those that are not as at the last solve of everything
    std::vector<BrickKey> published;  ///< all that are not the same bricks as then, or are gone
  };
  Change change(const DistanceField& field) const;

  /// The light that new samples lie in.
  struct Light {
    const IrradianceModel& room;
    const Illumination& illumination;
    const std::vector<Eigen::Vector3f>& on_floor;  ///< IrradianceModel::light_on_floor
    int rays;                                      ///< gathered by each
  };
  /// Solves the samples of the changed bricks anew, with the others around them as they are, and writes their points'
  /// albedo into `bricks`. Gives the number of samples.
  std::size_t solve(const DistanceField& field, const FieldRays& rays, const MetalMask& metal, const Light& light,
                    const Change& change, BrickMap<AlbedoBrick>& bricks);

 private:
  /// A brick's surface in a few numbers.
  struct Look {
    float count = 0;                                     ///< voxels next to the surface
    Eigen::Vector3f radiance = Eigen::Vector3f::Zero();  ///< their mean
    Eigen::Vector3f middle = Eigen::Vector3f::Zero();    ///< voxels
    bool differs(const Look& other) const;
  };
  static Look look_of(const FieldBrick& brick, float voxel_m);

  struct Brick {
    Look look;
    std::vector<SurfacePoint> points;
    std::vector<PointAlbedo> albedo;  ///< of each point
  };
  struct Sample {
    SurfaceSample surface;
    Eigen::Vector3f gathered;
    SampleAlbedo albedo;
  };
  using Bricks = std::unordered_map<BrickKey, Brick, BrickKeyHash>;

  std::set<SampleCell> refresh_points(const DistanceField& field, const FieldRays& rays, const MetalMask& metal,
                                      const std::vector<BrickKey>& changed);
  void write(const std::vector<BrickKey>& changed, BrickMap<AlbedoBrick>& bricks) const;

  float voxel_m_ = 0, sample_m_ = 0, dark_ = 0;
  double count_ = 0;              ///< of all looks
  std::set<BrickKey> since_all_;  ///< bricks that were solved alone since the last solve of everything
  BrickMap<FieldBrick> seen_;     ///< the field's when it was last solved
  Bricks bricks_;                 ///< that have surface
  std::map<SampleCell, Sample> samples_;
};

}  // namespace lumigraft::reconstruct
