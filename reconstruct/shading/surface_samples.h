#pragma once
// The coloured surface of the distance field as points, and a coarser set of samples to solve on.
#include <Eigen/Core>
#include <optional>
#include <tuple>
#include <vector>

#include "reconstruct/field/distance_field.h"
#include "reconstruct/field/field_rays.h"
#include "reconstruct/field/real_surface_mesh.h"

namespace lumigraft::reconstruct {

/// A voxel next to the surface.
struct SurfacePoint {
  BrickKey brick{};
  int index = 0;             ///< in the brick
  Eigen::Vector3f position;  ///< on the surface, metres
  Eigen::Vector3f normal;    ///< towards free space
  Eigen::Vector3f radiance;  ///< towards the cameras
  float weight = 0;          ///< of its measurements (FieldBrick::weight)
  bool metal = false;
  int sample = -1;  ///< index of the sample that represents it
};

struct SampleAlbedo {
  Eigen::Vector3f albedo = Eigen::Vector3f::Zero();
  float sigma = -1;  ///< 1σ, mean of the channels; negative = unknown
};

/// A patch of surface.
struct SurfaceSample {
  Eigen::Vector3f position;  ///< of the point nearest to the patch's centroid
  Eigen::Vector3f normal;    ///< mean over the patch
  Eigen::Vector3f radiance;  ///< mean over the patch
  float size_m = 0;          ///< edge of its cell
  float spread = 0;          ///< standard deviation of log luminance over the patch
  float texture = 0;         ///< the same after a linear slope is removed: texture or a shadow edge
  bool usable = true;        ///< one smooth piece of surface, no rim
  float floor_light = 0;     ///< irradiance from the unseen floor, whose albedo is a guess; mean of the channels,
  float surface_light = 0;   ///< and from surface that the colour camera measured
  SampleAlbedo known = {};   ///< as solved under earlier, other light
};

/// Level of size, three coordinates, and signed axis nearest to the normals of its points.
using SampleCell = std::tuple<int, int, int, int, int>;

struct Surface {
  std::vector<SurfacePoint> points;    ///< in a fixed order: by brick, then by index
  std::vector<SurfaceSample> samples;  ///< of those that are not metal
  std::vector<SampleCell> cells;       ///< of each sample
  float sample_m = 0;                  ///< edge of the smallest cells
};

/// Whether a voxel is next to the surface and has colour.
bool on_surface(const FieldBrick& brick, int index, float voxel_m);
/// The points of one brick.
std::vector<SurfacePoint> points_in(const DistanceField& field, const BrickKey& key, const FieldRays& rays,
                                    const MetalMask& metal);
/// The cell of a point; the smallest cells are `sample_m` wide.
SampleCell cell_of(const SurfacePoint& point, float sample_m);
/// The sample that represents some points (`members`) of one cell.
SurfaceSample patch(const std::vector<SurfacePoint>& points, const std::vector<int>& members, const SampleCell& cell,
                    float sample_m);

/// Indices of every sample's nearest neighbours of similar orientation.
std::vector<std::vector<int>> neighbours(const std::vector<SurfaceSample>& samples);

/// Whether the patch overlaps the print of the tag.
bool on_tag_print(const SurfaceSample& sample, double print_edge_m);

/// The white paper of the tag, a surface of known albedo; empty if too little of it was measured.
std::optional<SurfaceSample> tag_paper(const std::vector<SurfacePoint>& points, double print_edge_m);

/// Points where the field crosses zero and has colour; samples from the smallest cells, at least `min_cell_m` wide,
/// that give at most `max_samples`.
Surface find_surface(const DistanceField& field, const FieldRays& rays, const MetalMask& metal, int max_samples,
                     float min_cell_m = 0);

}  // namespace lumigraft::reconstruct
