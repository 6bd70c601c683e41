#pragma once
// Solutions of albedo, kept so that later ones need to solve only what is new or changed.
#include <Eigen/Core>
#include <cstddef>
#include <map>
#include <set>
#include <unordered_map>
#include <vector>

#include "reconstruct/albedo/albedo_bricks.h"
#include "reconstruct/albedo/surface_lighting.h"
#include "reconstruct/field/real_surface_mesh.h"
#include "reconstruct/shading/irradiance.h"
#include "reconstruct/shading/surface_samples.h"

namespace lumigraft::reconstruct {

class IncrementalSolver {
 public:
  /// Keeps a complete solution: `gathered` and `albedo` per sample, `points` per point.
  void keep(const DistanceField& field, const Surface& surface, const std::vector<Eigen::Vector3f>& gathered,
            const std::vector<SampleAlbedo>& albedo, const std::vector<PointAlbedo>& points, float noise_floor);
  void forget() { *this = {}; }
  /// Of the samples, by their cell; those that are unknown left out.
  std::map<SampleCell, SampleAlbedo> albedo() const;

  struct Change {
    std::vector<BrickKey> bricks;  ///< whose surface is new, gone, elsewhere, or of another radiance than when solved
    double points = 0;             ///< approximate number of surface points of the field,
    double weight = 0;             ///< and of their measurements' weight
    double fraction = 0;           ///< of the bricks with surface that differ from the last complete solution
    std::vector<BrickKey> published;  ///< all whose pointer differs from then, or that are gone
  };
  Change change(const DistanceField& field) const;
  /// The part of it that has more surface than when solved: what was clipped, dark or hidden in another light.
  Change grown(const DistanceField& field) const;

  /// Light on new samples.
  struct Light {
    const IrradianceModel& room;
    const Illumination& illumination;
    const std::vector<Eigen::Vector3f>& floor_grid;  ///< IrradianceModel::lamp_irradiance_on_floor
    int rays;                                        ///< gathered per sample
    float model_error;                               ///< as for SurfaceLighting
  };
  /// Solves the samples of the changed bricks with the samples around them fixed, and writes the albedo of their points
  /// into `bricks`. Returns the number of samples.
  std::size_t solve(const DistanceField& field, const FieldRays& rays, const MetalMask& metal, const Light& light,
                    const Change& change, BrickMap<AlbedoBrick>& bricks);

 private:
  /// A brick's surface, summarized.
  struct BrickSummary {
    float count = 0;                                     ///< of voxels next to the surface,
    float weight = 0;                                    ///< and of their measurements
    Eigen::Vector3f radiance = Eigen::Vector3f::Zero();  ///< their mean
    Eigen::Vector3f centroid = Eigen::Vector3f::Zero();  ///< in voxels
    bool differs(const BrickSummary& other) const;
  };
  static BrickSummary summarize(const FieldBrick& brick, float voxel_m);

  struct Brick {
    BrickSummary summary;
    std::vector<SurfacePoint> points;
    std::vector<PointAlbedo> albedo;  ///< of each point
  };
  struct Sample {
    SurfaceSample surface;
    Eigen::Vector3f gathered;
    SampleAlbedo albedo;
  };
  using Bricks = std::unordered_map<BrickKey, Brick, BrickKeyHash>;
  /// What one call solves.
  struct Part {
    Surface surface;                        ///< points of the changed bricks; samples, those that are held last
    std::vector<Eigen::Vector3f> gathered;  ///< per sample
    std::vector<SampleAlbedo> held;         ///< known albedo of the last samples
  };

  void set_weight(const BrickKey& key, const FieldBrick& brick);
  std::set<SampleCell> refresh_points(const DistanceField& field, const FieldRays& rays, const MetalMask& metal,
                                      const std::vector<BrickKey>& changed);
  std::set<BrickKey> bricks_of(const std::set<SampleCell>& cells, const std::vector<BrickKey>& changed) const;
  Part part_of(const std::set<SampleCell>& cells, const std::vector<BrickKey>& changed, const Light& light);
  void write(const std::vector<BrickKey>& changed, BrickMap<AlbedoBrick>& bricks) const;

  float voxel_m_ = 0, sample_m_ = 0, noise_floor_ = 0;
  double count_ = 0, weight_ = 0;   ///< of surface voxels in all bricks; BrickSummary::weight
  std::set<BrickKey> incremental_;  ///< bricks solved since the last complete solution
  BrickMap<FieldBrick> seen_;       ///< bricks of the field when last solved
  Bricks bricks_;                   ///< with surface
  std::map<SampleCell, Sample> samples_;
};

}  // namespace lumigraft::reconstruct
