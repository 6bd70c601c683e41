#pragma once
// All that the reference renderer knows of a room and what is put into it: triangles, lamps, and light from far away.
// A plain value; reference_scene_of() makes one of a reconstructed Scene, others may fill it themselves.
#include <Eigen/Geometry>
#include <memory>
#include <optional>
#include <vector>

#include "capture/camera/camera_model.h"
#include "reconstruct/light/light.h"
#include "relight/exhibit/exhibit.h"

namespace lumigraft::relight {

using Rgb = Eigen::Array3f;

struct ReferenceMesh {
  std::shared_ptr<const Model> model;
  Eigen::Affine3f T_tag_model = Eigen::Affine3f::Identity();
  MaterialOverride material;
  bool seen = false;  ///< where ReferenceScene::seen shows this point, its material counts instead
  /// false: it reflects, but lamps shine through it, and nothing is hidden by it.
  bool hides = true;
};

/// The same models, placed and painted alike.
bool same_meshes(const std::vector<ReferenceMesh>& a, const std::vector<ReferenceMesh>& b);

/// Materials of real surfaces as a camera sees them, finer than a mesh's vertices carry them.
struct SeenMaterials {
  capture::CameraModel camera;
  Eigen::Isometry3f T_camera_tag = Eigen::Isometry3f::Identity();
  capture::Image<float> depth_m;  ///< 1 channel; 0: nothing there
  capture::Image<float> diffuse;  ///< 3 channels, albedo of the Lambert part
  capture::Image<float> f0;       ///< 3 channels; 0: Lambert alone
  capture::Image<float> alpha;    ///< 1 channel, GGX
};

/// Lamps absorb what falls on them and shine with even radiance: a sphere all around, a flat lamp from one side.
struct ReferenceLamp {
  enum class Shape { sphere, rectangle, disc };
  Shape shape = Shape::sphere;
  Eigen::Vector3f centre_m = Eigen::Vector3f::Zero();
  float radius_m = 0;                                  ///< of a sphere or disc
  Eigen::Vector3f half_u_m = Eigen::Vector3f::Zero();  ///< of a rectangle: from the centre to the middle of an edge
  Eigen::Vector3f half_v_m = Eigen::Vector3f::Zero();  ///< at right angles to it
  Eigen::Vector3f normal = -Eigen::Vector3f::UnitZ();  ///< of a flat lamp's lit side
  Rgb radiance = Rgb::Zero();                          ///< W/sr/m²
  /// A spot's beam: full radiance where the cosine to the normal is above `cos_full`, none below `cos_none`, a smooth
  /// cubic between. As it stands: everywhere on the lit side.
  float cos_full = 0, cos_none = -1;
  /// false: a part of what the fish-eye saw there, and what else comes from there shines through it.
  bool hides = true;
};

struct ReferenceScene {
  std::vector<ReferenceMesh> real;
  std::vector<ReferenceMesh> objects;  ///< virtual
  std::vector<ReferenceLamp> lamps;
  reconstruct::EnvironmentMap environment;  ///< light from far away; empty: `background` from everywhere
  Rgb background = Rgb::Zero();
  std::shared_ptr<const SeenMaterials> seen;  ///< null: meshes say it all
};

}  // namespace lumigraft::relight
