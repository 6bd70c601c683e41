#include "relight/gather/seen_radiance.h"

#include "relight/gather/parameters.h"

namespace lumigraft::relight {

std::optional<Rgb> SeenRadiance::at(const Eigen::Vector3f& p_m) const {
  const Eigen::Vector3f p = T_camera_tag_ * p_m;
  if (!(p.z() > 0)) return std::nullopt;
  const auto pixel = camera_.project(p.cast<double>());
  if (!pixel || !camera_.inside(*pixel)) return std::nullopt;
  const int left = static_cast<int>(std::floor(pixel->x())), top = static_cast<int>(std::floor(pixel->y()));
  const float right = static_cast<float>(pixel->x()) - static_cast<float>(left),
              down = static_cast<float>(pixel->y()) - static_cast<float>(top), far_m = p.norm();
  Rgb sum = Rgb::Zero();
  float weights = 0;
  for (int k = 0; k < 4; ++k) {
    const int u = left + (k & 1), v = top + (k >> 1);
    if (u < 0 || v < 0 || u >= camera_.width || v >= camera_.height) continue;
    const auto i = static_cast<std::size_t>(v * camera_.width + u);
    if (!seen_[i].known || std::abs(seen_[i].depth_m - far_m) > near_m_ + kGather.seen_far_fraction * far_m) continue;
    const float weight = (k & 1 ? right : 1 - right) * (k >> 1 ? down : 1 - down);
    sum += weight * radiance_at(radiance_, i);
    weights += weight;
  }
  if (!(weights > 0)) return std::nullopt;
  return Rgb(sum / weights);
}

}  // namespace lumigraft::relight
