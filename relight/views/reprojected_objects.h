#pragma once
// Objects where they are now, as the camera sees them now, with the light that was found for an earlier view.
#include <map>
#include <memory>
#include <vector>

#include "relight/views/view_light.h"

namespace lumigraft::relight {

/// The objects of a view's light at other places and in other poses, ready for rays.
class MovedObjects {
 public:
  /// `trees`: of models in other poses, by the model at rest; those of the view's objects are kept between calls.
  /// `now`: the objects of `view` in the same order.
  using Trees = std::map<std::shared_ptr<const IrradianceProbes>, PosedTrees>;
  MovedObjects(const ViewLight& view, const std::vector<ReferenceMesh>& now, Trees& trees);

  const Meshes& meshes() const { return *meshes_; }
  /// Where the view had the point of a hit, and the geometric normal of its triangle, of any length and on any side;
  /// tag frame.
  struct Then {
    Eigen::Vector3f position_m, normal;
  };
  Then then(const MeshHit& hit) const;
  const Eigen::Matrix3f& normals(std::uint32_t mesh) const { return objects_[mesh].normals; }

 private:
  struct Object {
    std::shared_ptr<const Model> model_then;
    Eigen::Affine3f T_tag_model_then = Eigen::Affine3f::Identity();
    Eigen::Matrix3f normals = Eigen::Matrix3f::Identity();  ///< from model frame to tag frame, now
  };
  std::vector<Object> objects_;
  std::unique_ptr<Meshes> meshes_;
};

/// Silhouettes are those of now; a pixel's radiance is that of the pixels of `view` that show the same surface (Nehab
/// et al. 2007, "Accelerating Real-Time Shading with Reverse Reprojection Caching"). Of surface that the view did not
/// show the indirect irradiance of its vertices is known, light of lamps is traced, and its gloss is missing. `room`:
/// as the camera sees it now (reprojected).
ObjectLayer reprojected_objects(const ViewLight& view, const MovedObjects& objects, const RoomInView& room,
                                const CameraRays& eye, const CurrentDepth& depth);

}  // namespace lumigraft::relight
