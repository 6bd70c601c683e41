#pragma once
// Picking: an object is put on the surface of the room that a pixel of the picture shows.
#include <Eigen/Geometry>
#include <string>
#include <variant>

#include "capture/camera/camera_model.h"
#include "reconstruct/field/distance_field.h"
#include "relight/exhibit/exhibit.h"

namespace lumigraft::server {

/// What the newest picture shows.
struct SeenRoom {
  Eigen::Isometry3d T_tag_camera, T_tag_exhibit;
  const reconstruct::DistanceField* field;
};

/// VirtualObject::position_m, in the exhibit's frame, at which the lowest point of the object, as the model is at rest,
/// is level with the surface that the pixel shows, and its origin above it; else what was found and what is allowed.
std::variant<Eigen::Vector3d, std::string> place_on_picked_surface(const SeenRoom& room,
                                                                   const capture::CameraModel& camera,
                                                                   const Eigen::Vector2d& pixel,
                                                                   const relight::VirtualObject& object);

}  // namespace lumigraft::server
