#pragma once
// Cameras of a session, their calibration and poses: session.toml, or the camera tables of a kiosk's configuration.
#include <Eigen/Geometry>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "capture/camera/camera_model.h"
#include "capture/camera/depth_noise.h"
#include "capture/camera/response.h"
#include "capture/camera/vignetting.h"
#include "capture/session/camera_settings.h"
#include "capture/session/config.h"

namespace lumigraft::capture {

struct ColorCamera {
  std::string source;  ///< URI: images:color.txt, mkv:color.mkv, oni:rgbd.oni, openni2:, v4l2:, libcamera:, aravis:
  std::string serial;  ///< serial number or unique name of this camera; empty: not known
  CameraModel model;
  double exposure = 1.0;
  Response response = Response::srgb();
  Vignetting vignetting = {};
  /// From the exposure of an image's first row to that of its last; 0: all at once, negative: from the last row.
  /// Empty: as the camera reports it.
  std::optional<double> readout_s = std::nullopt;
  CameraSettings settings = {};  ///< of live cameras
};

struct DepthCamera {
  std::string source;
  std::string serial;
  double unit_m = 0.001;   ///< metres per count
  bool registered = true;  ///< depth is on the colour camera's pixels; else `model` and `T_color_depth` register it
  CameraModel model;       ///< of the depth camera if not registered, else the colour camera's
  Eigen::Isometry3d T_color_depth = Eigen::Isometry3d::Identity();
  DepthPrinciple principle = DepthPrinciple::structured_light;
  double noise_scale = 1;        ///< measured noise over that of a usual camera of its principle
  CameraSettings settings = {};  ///< of live cameras
};

struct FisheyeCamera {
  std::string source;
  std::string serial;
  CameraModel model;
  double exposure = 1.0;
  Response response = Response::srgb();
  Vignetting vignetting = {};
  /// Added to the times of its frames before they are paired with those of the colour camera.
  double time_offset_s = 0.0;
  Eigen::Isometry3d T_tag_fisheye = Eigen::Isometry3d::Identity();
  CameraSettings settings = {};  ///< of live cameras
};

/// An additional tag of the same family, fixed in the room.
struct ExtraTag {
  int id = 0;
  double size_m = 0.16;                          ///< edge of the black square
  std::optional<Eigen::Isometry3d> T_tag_extra;  ///< empty: estimated from frames that show both tags
};

/// The tag whose frame is the world.
struct Tag {
  std::string family = "tag36h11";
  int id = 0;
  double size_m = 0.16;  ///< edge of the black square; 0: no tag, the world is a level surface of the room
  std::vector<ExtraTag> extra = {};
  std::filesystem::path map = {};  ///< file of the extra tags' learnt poses; empty: not stated
  bool moves_exhibit = false;      ///< the exhibit follows the first tag if it is moved in the room; else it stays

  bool present() const { return size_m > 0; }
};

/// A lamp that carries a tag of the family of `Tag`. The lamp's position follows from the tag in the colour frame.
struct TaggedLamp {
  std::string name;  ///< for warnings
  int tag_id = 0;
  double tag_size_m = 0.06;                              ///< edge of the black square
  Eigen::Vector3d position_m = Eigen::Vector3d::Zero();  ///< of its centre, in the frame of its tag
  double radius_m = 0.03;                                ///< of the emitting surface
  std::optional<Eigen::Vector3d> normal;                 ///< of a planar lamp: unit vector in the frame of its tag
  std::optional<Eigen::Vector3f> intensity;              ///< W/sr per channel along the normal; empty: estimated
};

/// A real surface whose material is stated because no camera can measure it. GGX alpha = roughness².
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

  DepthNoise depth_noise() const { return depth ? usual_noise(depth->principle, depth->noise_scale) : DepthNoise(); }
};

/// Reads the camera tables of `root`. `calibration = "FILE"` names a file written by `lumigraft calibrate`; it replaces
/// the lens keys and is refused if it belongs to another camera. Other tables are left unread, so the caller calls
/// root.finish(). Throws InputError.
Session read_session(const ConfigTable& root);

}  // namespace lumigraft::capture
