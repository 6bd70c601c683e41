#pragma once
// The coloured surface of the distance field as points, and a thinned set of them to solve on.
#include <Eigen/Core>
#include <optional>
#include <tuple>
#include <vector>

#include "reconstruct/field/distance_field.h"
#include "reconstruct/field/field_rays.h"
#include "reconstruct/field/metal_mask.h"

namespace lumigraft::reconstruct {

/// One voxel next to the surface.
struct SurfacePoint {
  BrickKey brick{};
  int index = 0;             ///< in the brick
  Eigen::Vector3f position;  ///< on the surface, metres
  Eigen::Vector3f normal;    ///< towards free space
  Eigen::Vector3f radiance;  ///< towards the cameras
  bool metal = false;
  int sample = -1;  ///< of the thinned set, the one that stands for it
};

/// A patch of surface.
struct SurfaceSample {
  Eigen::Vector3f position;  ///< of the point nearest to the patch's middle
  Eigen::Vector3f normal;    ///< mean over the patch
  Eigen::Vector3f radiance;  ///< mean over the patch
  float size_m = 0;          ///< edge of its cell
  float spread = 0;          ///< standard deviation of log luminance over the patch
  float texture = 0;         ///< the same but for an even slope of it: texture, or a shadow's edge
  bool usable = true;        ///< one smooth piece of surface: not the rim of something
};

/// Where a sample's points lie: how large the cell is, its place, and the axis that their normals are nearest to.
using SampleCell = std::tuple<int, int, int, int, int>;

struct Surface {
  std::vector<SurfacePoint> points;    ///< in a fixed order: by brick, then by index
  std::vector<SurfaceSample> samples;  ///< of those that are not metal
  std::vector<SampleCell> cells;       ///< of each sample
  float sample_m = 0;                  ///< edge of the smallest cells that samples were taken from
};

/// Whether a voxel of a brick is one that the surface is next to, and colour was seen there.
bool on_surface(const FieldBrick& brick, int index, float voxel_m);
/// The points of one brick.
std::vector<SurfacePoint> points_in(const DistanceField& field, const BrickKey& key, const FieldRays& rays,
                                    const MetalMask& metal);
/// The cell of a point that is not metal, smallest cells being `sample_m` wide.
SampleCell cell_of(const SurfacePoint& point, float sample_m);
/// What some points of one cell are together.
SurfaceSample patch(const std::vector<SurfacePoint>& points, const std::vector<int>& members, const SampleCell& cell,
                    float sample_m);

/// Whether some of a patch is the tag's print.
bool on_tag(const SurfaceSample& sample, double tag_size_m);

/// The white of the tag's paper, of which more is known than of any other surface; empty where too little of it was
/// seen.
std::optional<SurfaceSample> tag_paper(const std::vector<SurfacePoint>& points, double tag_size_m);

/// Points where the field crosses zero and colour was seen; samples from cells as small as gives at most
/// `most_samples`, and no smaller than `least_m`.
Surface find_surface(const DistanceField& field, const FieldRays& rays, const MetalMask& metal, int most_samples,
                     float least_m = 0);

}  // namespace lumigraft::reconstruct
