#include "relight/objects/placement.h"

#include "relight/objects/parameters.h"

namespace lumigraft::relight {
namespace {

shader::vec4 centred(const Eigen::Vector3f& centre_m, float edge_m, int voxels) {
  const float voxel = edge_m / static_cast<float>(voxels);
  const Eigen::Vector3f low = centre_m - Eigen::Vector3f::Constant(0.5f * edge_m);
  shader::vec4 grid;
  // A voxel border may be at the objects' centre; the offset keeps rounding from alternating between two voxels.
  grid << ((low / voxel).array() + 1e-3f).floor().matrix() * voxel, voxel;
  return grid;
}

BoundingSphere join(const BoundingSphere& a, const BoundingSphere& b) {
  const Eigen::Vector3f to = b.centre_m - a.centre_m;
  const float apart = to.norm();
  if (apart + b.radius_m <= a.radius_m) return a;
  if (apart + a.radius_m <= b.radius_m) return b;
  const float radius = 0.5f * (apart + a.radius_m + b.radius_m);
  return {a.centre_m + to * ((radius - a.radius_m) / apart), radius};
}

}  // namespace

BoundingSphere bounding_sphere(const std::vector<Eigen::Vector3f>& points_m) {
  Eigen::AlignedBox3f box;
  for (const auto& p : points_m) box.extend(p);
  BoundingSphere sphere{box.center(), 0};
  for (const auto& p : points_m) sphere.radius_m = std::max(sphere.radius_m, (p - sphere.centre_m).norm());
  return sphere;
}

Placement place_volumes(const std::vector<PlacedBounds>& objects, int voxels, float max_voxel_m) {
  Placement placement;
  Eigen::AlignedBox3f box;
  BoundingSphere sphere = objects.front().sphere;
  for (const auto& object : objects) {
    box.extend(object.box);
    sphere = join(sphere, object.sphere);
  }
  // With many objects the box's sphere may be the smaller one.
  const BoundingSphere around_box{box.center(), 0.5f * box.diagonal().norm()};
  placement.sphere = around_box.radius_m < sphere.radius_m ? around_box : sphere;

  const float edge = kObjects.inner_edge * sphere.radius_m;
  placement.cascade[0] = centred(placement.sphere.centre_m, edge, voxels);
  float lit_m = 0;  // from the middle: there the brightest object's irradiance over π is min_visible
  for (const auto& object : objects)
    lit_m = std::max(lit_m, object.sphere.radius_m * std::sqrt(object.emission / kObjects.min_visible));
  const float outer =
      std::max(kObjects.outer_edge * edge, std::min(2 * lit_m, max_voxel_m * static_cast<float>(voxels)));
  placement.cascade[1] = centred(placement.sphere.centre_m, outer, voxels);

  const float voxel = box.sizes().maxCoeff() / static_cast<float>(voxels - 2 * kObjects.margin - 1);
  const Eigen::Vector3f low = ((box.min() / voxel).array().floor() - kObjects.margin).matrix() * voxel;
  placement.virtual_grid << low, voxel;
  placement.virtual_size =
      (((box.max() - low) / voxel).array().ceil() + kObjects.margin + 1).matrix().cast<int>().cwiseMin(voxels + 2);
  return placement;
}

}  // namespace lumigraft::relight
