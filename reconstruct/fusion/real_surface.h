#pragma once
// Real surfaces named by the session ([[real_surface]]): registration in depth images, and merging into the field.
#include <Eigen/Geometry>
#include <map>
#include <string>
#include <vector>

#include "capture/session/session.h"
#include "reconstruct/field/distance_field.h"
#include "reconstruct/pose/depth_points.h"

namespace lumigraft::reconstruct {

/// Distances to the models in a brick; weight 0 where there is no model.
struct SurfaceBrick {
  std::array<float, kBrickVoxels> distance_m{}, weight{};
  bool mirror = false;  ///< one of the models is a mirror
};

/// Registers models by ICP of depth against the model, starting from the pose in the session; the result is the mean
/// over the first frames that observe the model. A model that most depth rays pass through is rejected, unless it is a
/// mirror, whose depth is that of its reflection. A model that is rejected or beyond the reach of ICP is not used, with
/// a warning.
class RealSurfaces {
 public:
  enum class State { unobserved, used, rejected };
  struct Found {
    std::string name;
    State state = State::unobserved;
    Eigen::Isometry3d T_tag_model = Eigen::Isometry3d::Identity();  ///< offset from the session's pose
    int frames = 0;                                                 ///< in the mean
  };

  /// Throws InputError if a mesh cannot be read.
  RealSurfaces(const capture::Session& session, float voxel_m);

  bool any() const { return !models_.empty(); }
  /// Registers the models in a depth image. True if the result of bricks() changed.
  bool register_models(const capture::Image<float>& depth_m, const Eigen::Isometry3d& T_tag_camera);

  /// Distances to the nearest used model, by brick of the room's grid.
  std::map<BrickKey, std::shared_ptr<const SurfaceBrick>> bricks() const;
  /// Whether a used mirror is between camera and point (tag frame): a measurement there is a reflection.
  bool behind_mirror(const Eigen::Vector3f& camera_m, const Eigen::Vector3f& point_m) const;

  const std::vector<Found>& found() const { return found_; }
  std::vector<std::string> warnings() const;

 private:
  struct Model {
    DistanceField field;
    bool mirror;
  };
  struct Observation;
  DepthGrid sample(const capture::Image<float>& depth_m) const;
  Observation observe(const Model& model, const DepthGrid& grid, const Eigen::Isometry3d& T_model_camera) const;

  float voxel_m_;
  capture::DepthNoise noise_;
  int step_, columns_, rows_;
  std::vector<Eigen::Vector3f> rays_;  ///< of every step-th pixel, z = 1; 0 where the lens model has no ray
  std::vector<Model> models_;
  std::vector<Found> found_;
};

/// Merges a model into a brick. Keeps measurements near the model and in front of it. Inside the model the field
/// becomes solid where depth passed through or measured nothing. Unobserved sides get no surface, since it would have
/// no radiance; those of a mirror do, since depth never measures a mirror.
FieldBrick merge_model(const FieldBrick& brick, const SurfaceBrick& model, float voxel_m);

}  // namespace lumigraft::reconstruct
