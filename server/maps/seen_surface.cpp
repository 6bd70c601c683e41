#include "server/maps/seen_surface.h"

#include <algorithm>
#include <utility>

#include "server/maps/parameters.h"

namespace lumigraft::server {

void SeenSurface::update(const capture::CameraModel& camera, const Eigen::Isometry3d& T_tag_camera,
                         std::shared_ptr<const reconstruct::DistanceField> field) {
  const int step = kMaps.pixels_apart;
  const int columns = (camera.width + step - 1) / step, rows = (camera.height + step - 1) / step;
  if (columns == columns_ && rows == rows_ && field == field_ && T_tag_camera.matrix() == T_tag_camera_.matrix())
    return;
  columns_ = columns;
  rows_ = rows;
  field_ = std::move(field);
  T_tag_camera_ = T_tag_camera;
  pixels_.assign(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows), std::nullopt);
  const Eigen::Vector3f from_m = T_tag_camera.translation().cast<float>();
  const Eigen::Vector3f forward = T_tag_camera.linear().col(2).cast<float>();
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      const auto ray = camera.unproject({step * column + 0.5 * (step - 1), step * row + 0.5 * (step - 1)});
      if (!ray) continue;
      const Eigen::Vector3f direction = (T_tag_camera.linear() * ray->normalized()).cast<float>();
      const auto hit = field_->raycast(from_m, direction, kMaps.near_m, kMaps.far_m);
      if (!hit) continue;
      pixels_[static_cast<std::size_t>(row * columns + column)] = {hit->position_m, hit->normal,
                                                                   hit->distance_m * forward.dot(direction)};
    }
  }
}

const std::optional<SeenSurface::Pixel>& SeenSurface::at(int u, int v) const {
  return pixels_[static_cast<std::size_t>(v / kMaps.pixels_apart * columns_ + u / kMaps.pixels_apart)];
}

}  // namespace lumigraft::server
