#pragma once
// A cubic room around the origin, rendered wall by wall with one wall filling the picture: the light that arrives at
// all six walls sums to the light that leaves an object.
#include <numbers>

#include "tests/relight/closed_form/closed_scene.h"

namespace lumigraft::test {

struct CubeRoom : ClosedScene {
  float half_m, from_m;  ///< half edge of the cube; distance of the camera in front of its centre

  CubeRoom(float half, float from, float wall_m = 0.05f) : half_m(half), from_m(from) {
    width = height = 40;
    focal_px = 0.5 * width * (half_m - from_m) / half_m;  // a wall exactly fills the picture
    distance = [half, wall_m](const Eigen::Vector3f& p) {
      const Eigen::Vector3f middle = Eigen::Vector3f::Constant(half + 0.5f * wall_m);
      return std::abs(box_distance({-middle, middle}, p)) - 0.5f * wall_m;
    };
    const Eigen::Vector3f outside = Eigen::Vector3f::Constant(half_m + wall_m + 0.04f);
    extent = {-outside, outside};
  }

  /// Sets walls of this albedo under one lamp, without sky.
  void light_walls(float walls, const reconstruct::PointLight& lamp) {
    albedo = walls;
    sky = 0;
    lamps = {lamp};
    radiance = [half = half_m, walls, lamp](const Eigen::Vector3f& p) {
      int axis = 0;
      p.cwiseAbs().maxCoeff(&axis);
      Eigen::Vector3f n = Eigen::Vector3f::Zero(), on = p;
      n[axis] = p[axis] > 0 ? -1.0f : 1.0f;
      on[axis] = -half * n[axis];
      return walls / std::numbers::pi_v<float> * irradiance(lamp, on, n);
    };
  }

  /// Calls `visit` with the change of arriving light, in W, per pixel of each wall.
  template <typename Visit>
  void change_on_walls(relight::Renderer& renderer, const relight::Plan& plan, const Visit& visit) {
    const float pixel_m = 2 * half_m / static_cast<float>(width);
    for (int wall = 0; wall < 6; ++wall) {
      Eigen::Vector3f axis = Eigen::Vector3f::Zero();
      axis[wall / 2] = wall % 2 ? -1.0f : 1.0f;
      eye_m = from_m * axis;
      look_at_m = axis;
      const relight::RelitPicture picture = relit(renderer, plan);
      for (std::size_t i = 0; i < picture.maps->delta.data.size(); i += 3) {
        visit(std::numbers::pi_v<float> / albedo * picture.maps->delta.data[i] * pixel_m * pixel_m);
      }
    }
  }
};

}  // namespace lumigraft::test
