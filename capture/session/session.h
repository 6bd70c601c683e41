#pragma once
// What the cameras are and how they stand: session.toml, or the camera part of a kiosk's configuration.
#include <Eigen/Geometry>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "capture/camera/camera_model.h"
#include "capture/camera/response.h"
#include "capture/camera/vignetting.h"
#include "capture/session/camera_settings.h"
#include "capture/session/config.h"

namespace lumigraft::capture {

struct ColorCamera {
  std::string source;  ///< URI: images:color.txt, mkv:color.mkv, oni:rgbd.oni, openni2:, v4l2:, libcamera:, aravis:
  std::string serial;  ///< what tells this camera from others of its kind; empty: not known
  CameraModel model;
  double exposure = 1.0;
  Response response = Response::srgb();
  CameraSettings settings = {};  ///< where live
};

struct DepthCamera {
  std::string source;
  std::string serial;
  double unit_m = 0.001;   ///< metres per count
  bool registered = true;  ///< the same pixels as colour; else the two below say how it becomes that
  CameraModel model;       ///< where not registered
  Eigen::Isometry3d T_color_depth = Eigen::Isometry3d::Identity();
};

struct FisheyeCamera {
  std::string source;
  std::string serial;
  CameraModel model;
  double exposure = 1.0;
  Response response = Response::srgb();
  Vignetting vignetting = {};  ///< key: the array of its three terms
  /// Added to the times of its pictures before they are paired with those of the colour camera.
  double time_offset_s = 0.0;
  Eigen::Isometry3d T_tag_fisheye = Eigen::Isometry3d::Identity();
  CameraSettings settings = {};  ///< where live
};

/// A further tag of the same family, fixed in the room.
struct ExtraTag {
  int id = 0;
  double size_m = 0.16;
  std::optional<Eigen::Isometry3d> T_tag_extra;  ///< its own frame in the tag's; empty: found while both are seen
};

struct Tag {
  std::string family = "tag36h11";
  int id = 0;
  double size_m = 0.16;  ///< edge of the black square
  std::vector<ExtraTag> also = {};
};

/// A lamp that carries a tag of the family of `Tag`: where the colour camera sees that, it is known where the lamp
/// stands.
struct TaggedLamp {
  std::string name;  ///< for warnings
  int tag_id = 0;
  double tag_size_m = 0.06;                              ///< edge of the black square
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();  ///< of its middle, in the frame of its tag
  double radius_m = 0.03;                                ///< of what glows
  std::optional<Eigen::Vector3d> normal;                 ///< unit, in the frame of its tag, where it glows as a plane
  std::optional<Eigen::Vector3f> intensity;              ///< W/sr per channel, straight ahead; where it was measured
};

/// A real surface whose material an operator knows and no camera can tell. GGX alpha = roughness².
struct RealSurface {
  std::string name;
  std::filesystem::path mesh;  ///< in the tag frame, metres
  float roughness = 1.0f;
  float metallic = 0.0f;
  float specular = 0.0f;
  Eigen::Vector3f base_color = Eigen::Vector3f::Zero();  ///< linear
};

struct Session {
  std::filesystem::path folder;
  std::string name;
  ColorCamera color;
  std::optional<DepthCamera> depth;
  std::optional<FisheyeCamera> fisheye;
  Tag tag;
  std::vector<TaggedLamp> lamps;
  std::vector<RealSurface> real_surfaces;
};

/// Reads the camera keys of `root`; `calibration = "FILE"` there names what `lumigraft calibrate` wrote, which stands
/// in place of the lenses' keys and is refused where it is of another camera. Leaves other tables for others to read,
/// so the caller calls root.finish(). Throws InputError.
Session read_session(const ConfigTable& root);

}  // namespace lumigraft::capture
