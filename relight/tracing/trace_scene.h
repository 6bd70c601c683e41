#pragma once
// Input of the reference renderer, for a room and the virtual objects in it: triangles, lamps, and distant light. A
// plain value; built from a reconstructed Scene by reference_room_of(), or by the caller.
#include <Eigen/Geometry>
#include <algorithm>
#include <memory>
#include <vector>

#include "capture/camera/camera_model.h"
#include "reconstruct/light/lamp_shadows.h"
#include "reconstruct/light/light.h"
#include "relight/exhibit/exhibit.h"

namespace lumigraft::relight {

using Rgb = Eigen::Array3f;

struct PosedCamera {
  capture::CameraModel model;
  Eigen::Isometry3f T_tag_camera = Eigen::Isometry3f::Identity();
};

struct ReferenceMesh {
  std::shared_ptr<const Model> model;
  Eigen::Affine3f T_tag_model = Eigen::Affine3f::Identity();
  MaterialOverride material;
  bool seen = false;  ///< where ReferenceScene::seen covers a point, its material replaces the mesh's
  /// false: it reflects, but does not occlude lamps or other surfaces
  bool hides = true;
  float white_radiance = 1;  ///< of emission 1, W/sr/m²
  RigPose pose = {};         ///< of the model
};

/// Whether models, their places and poses, materials and the radiance of white are equal.
inline bool same_meshes(const std::vector<ReferenceMesh>& a, const std::vector<ReferenceMesh>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const ReferenceMesh& x, const ReferenceMesh& y) {
    return x.model == y.model && x.T_tag_model.matrix() == y.T_tag_model.matrix() && x.material == y.material &&
           x.white_radiance == y.white_radiance && x.pose == y.pose;
  });
}

/// Materials of real surfaces per pixel of a camera, finer than per vertex of a mesh.
struct SeenMaterials {
  capture::CameraModel camera;
  Eigen::Isometry3f T_camera_tag = Eigen::Isometry3f::Identity();
  capture::Image<float> depth_m;  ///< 1 channel; 0: no surface
  capture::Image<float> diffuse;  ///< 3 channels, albedo of the Lambert part
  capture::Image<float> f0;       ///< 3 channels; 0: Lambert only
  capture::Image<float> alpha;    ///< 1 channel, GGX roughness
};

/// Lamps absorb incident light and emit constant radiance: a sphere in all directions, a flat lamp from one side.
struct ReferenceLamp {
  enum class Shape { sphere, rectangle, disc, ellipse };
  Shape shape = Shape::sphere;
  Eigen::Vector3f centre_m = Eigen::Vector3f::Zero();
  float radius_m = 0;                                  ///< of a sphere or disc
  Eigen::Vector3f half_u_m = Eigen::Vector3f::Zero();  ///< of a rectangle: from the centre to the midpoint of an edge
  Eigen::Vector3f half_v_m = Eigen::Vector3f::Zero();  ///< perpendicular to it; both of an ellipse: conjugate half axes
  Eigen::Vector3f normal = -Eigen::Vector3f::UnitZ();  ///< of a flat lamp's emitting side
  Rgb radiance = Rgb::Zero();                          ///< W/sr/m²
  /// Beam of a spot lamp: full radiance where the cosine to the normal is above `cos_full`, none below `cos_none`, a
  /// smooth cubic between. Default: the whole emitting side.
  float cos_full = 0, cos_none = -1;
  /// false: it occludes nothing; its radiance adds to what is behind it, as both are parts of what the fish-eye camera
  /// saw there.
  bool hides = true;
  int id = -1;  ///< PointLight::id; -1: none
};

struct ReferenceScene {
  std::vector<ReferenceMesh> real;
  std::vector<ReferenceMesh> objects;  ///< virtual objects
  std::vector<ReferenceLamp> lamps;
  reconstruct::EnvironmentMap environment;  ///< distant light; empty: `background` from all directions
  Rgb background = Rgb::Zero();
  std::shared_ptr<const SeenMaterials> seen;  ///< null: materials of the meshes only
  /// Of what `real` does not contain; null: none.
  std::shared_ptr<const reconstruct::LampShadows> shadows = {};
};

}  // namespace lumigraft::relight
