#include "server/pipeline/surface_picking.h"

#include <algorithm>
#include <limits>

#include "capture/message_text.h"
#include "server/pipeline/parameters.h"

namespace lumigraft::server {

std::variant<Eigen::Vector3d, std::string> place_on_picked_surface(const SeenRoom& room,
                                                                   const capture::CameraModel& camera,
                                                                   const Eigen::Vector2d& pixel,
                                                                   const relight::VirtualObject& object) {
  const auto ray = camera.inside(pixel) ? camera.unproject(pixel) : std::nullopt;
  if (!ray)
    return capture::formatted("on_pixel: found %g, %g, allowed: a pixel of the picture, %d x %d", pixel.x(), pixel.y(),
                              camera.width, camera.height);
  const Eigen::Vector3f direction = (room.T_tag_camera.linear() * ray->normalized()).cast<float>();
  const auto hit = room.field->raycast(room.T_tag_camera.translation().cast<float>(), direction, kPipeline.pick_near_m,
                                       kPipeline.pick_far_m);
  if (!hit) return "on_pixel: found no known surface there, allowed: a surface that depth has seen";
  const Eigen::Vector3d up = room.T_tag_exhibit.linear().col(2);
  if (const double level = up.dot(hit->normal.cast<double>()); level < kPipeline.pick_min_up)
    return "on_pixel: found a wall or a slope there, allowed: a surface on which an object can stand";
  Eigen::Vector3d place_m = room.T_tag_exhibit.inverse() * hit->position_m.cast<double>();
  if (!object.model || object.model->positions_m.empty()) return place_m;
  double lowest_m = std::numeric_limits<double>::infinity();
  for (const Eigen::Vector3f& p : object.model->positions_m)
    lowest_m = std::min(lowest_m, object.scale * (object.rotation * (p.cast<double>() - object.origin_m)).z());
  place_m.z() -= lowest_m;
  return place_m;
}

}  // namespace lumigraft::server
