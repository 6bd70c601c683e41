#pragma once
// What an operator said about real surfaces, found in depth pictures and laid into the distance field.
#include <Eigen/Geometry>
#include <map>
#include <string>
#include <vector>

#include "capture/session/session.h"
#include "reconstruct/field/distance_field.h"
#include "reconstruct/pose/depth_points.h"

namespace lumigraft::reconstruct {

/// What models say of a brick; weight 0 where there is none.
struct SurfaceBrick {
  std::array<float, kBrickVoxels> distance_m{}, weight{};
  bool mirror = false;  ///< one of them is
};

/// Models are registered where the camera sees them: ICP of depth against the model, beginning where the session says,
/// mean over the first pictures that show it. Depth that goes through a model denies it, unless it is a mirror: those
/// show depth of what they reflect. A model that depth denies, or that lies farther off than ICP reaches, is not used,
/// and a warning says so.
class RealSurfaces {
 public:
  enum class State { unseen, used, refused };
  struct Found {
    std::string name;
    State state = State::unseen;
    Eigen::Isometry3d T_tag_model = Eigen::Isometry3d::Identity();  ///< how far from where the session says
    int pictures = 0;                                               ///< that it was found in
  };

  /// Throws InputError where a mesh cannot be read.
  RealSurfaces(const capture::Session& session, float voxel_m);

  bool any() const { return !models_.empty(); }
  /// Whether what is to be merged is another than before.
  bool look(const capture::Image<float>& depth_m, const Eigen::Isometry3d& T_tag_camera);

  /// Distances to the nearest used model in the tag's grid; weight 0 where there is none.
  std::map<BrickKey, std::shared_ptr<const SurfaceBrick>> bricks() const;
  /// Whether a used mirror stands between camera and point: then what was measured there is a reflection.
  bool behind_mirror(const Eigen::Vector3f& camera_m, const Eigen::Vector3f& point_m) const;

  const std::vector<Found>& found() const { return found_; }
  std::vector<std::string> warnings() const;

 private:
  struct Model {
    DistanceField field;
    bool mirror;
  };
  struct Sight;
  DepthGrid sample(const capture::Image<float>& depth_m) const;
  Sight sight_of(const Model& model, const DepthGrid& grid, const Eigen::Isometry3d& T_model_camera) const;

  float voxel_m_;
  int step_, columns_, rows_;
  std::vector<Eigen::Vector3f> rays_;  ///< of every step-th pixel, z = 1; 0 where the camera sees nothing
  std::vector<Model> models_;
  std::vector<Found> found_;
};

/// A brick with a model in it. What depth tells near the model stays, and so does what stands before it; where the
/// model stands the field is solid, though depth went through or told nothing. Its sides that nobody saw get no
/// surface, which would be one without light; but a mirror gets one, since depth never shows it.
FieldBrick merged(const FieldBrick& brick, const SurfaceBrick& model, float voxel_m);

}  // namespace lumigraft::reconstruct
