#pragma once
// The light that was found for one view of the camera: what is needed to draw a picture of this view, or of one nearby.
#include <vector>

#include "relight/compose/object_layer.h"
#include "relight/gather/gbuffer.h"
#include "relight/gather/ray_objects.h"
#include "relight/tracing/light_samples.h"

namespace lumigraft::relight {

/// The surface at a pixel, tag frame.
struct ViewSurface {
  Eigen::Vector3f position_m = Eigen::Vector3f::Zero();
  Eigen::Vector3f normal = Eigen::Vector3f::UnitZ();  ///< unit, towards the camera
  float depth_m = 0;                                  ///< along the pixel's ray
  bool known = false;                                 ///< a surface exists
  bool glossy = false;                                ///< of known material with a directional (glossy) part
};

/// The room in a view whose pixels represent squares of the camera's. Arrays are by pixel of the view.
struct RoomInView {
  int scale = 1;  ///< edge of the squares, pixels of the camera
  capture::CameraModel camera;
  std::vector<ViewSurface> surfaces;
  capture::Image<float> change;    ///< 3 channels, L_Δ, W/sr/m²
  capture::Image<float> radiance;  ///< 3 channels, of the room without objects, W/sr/m²
  TileMask tiles;                  ///< that are traced: nothing changes in the others

  const ViewSurface& at(int u, int v) const {  ///< at a pixel of the camera
    return surfaces[static_cast<std::size_t>(v / scale) * static_cast<std::size_t>(camera.width) +
                    static_cast<std::size_t>(u / scale)];
  }
};

struct ViewLight {
  Eigen::Isometry3f T_tag_camera = Eigen::Isometry3f::Identity();
  RoomInView room;
  /// Of the camera's size, 255 where surface shows that moved in front of the room (front_mask); empty: nowhere.
  capture::Image<std::uint8_t> front;
  float moved = 0;  ///< fraction of the room's pixels that show such surface, or fused surface that is gone
  ObjectLayer objects;
  std::vector<ViewSurface> object_surfaces;  ///< by pixel of the layer's window, with geometric normals

  /// Where the objects were, and their light by vertex.
  std::vector<PlacedModel> placed;
  std::vector<std::vector<RayObjects::Irradiance>> irradiance;  ///< RayObjects::irradiance_of_vertices
  std::shared_ptr<const RayRoom> traced_room;
  std::vector<LightSampleSet> lamps;  ///< of the room
};

}  // namespace lumigraft::relight
