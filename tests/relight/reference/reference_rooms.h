#pragma once
// Small rooms for tests of the path-traced reference.
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <numbers>

#include "relight/reference/delta_path_tracer.h"
#include "tests/relight/exhibit/model_shapes.h"

namespace lumigraft::test {

constexpr float kPi = std::numbers::pi_v<float>;

inline relight::Material lambert(float albedo) { return {Eigen::Vector3f::Constant(albedo), 0, 1, 0}; }
inline relight::Material metal(float f0, float roughness) { return {Eigen::Vector3f::Constant(f0), 1, roughness, 1}; }

inline relight::ReferenceMesh mesh_of(const Points& corners, const relight::Material& material) {
  relight::Model model;
  add_part(&model, corners, material);
  relight::ReferenceMesh mesh;
  mesh.model = std::make_shared<const relight::Model>(std::move(model));
  return mesh;
}

/// A horizontal square, facing up.
inline relight::ReferenceMesh square(float half_m, float height_m, const relight::Material& material) {
  const auto at = [&](float x, float y) { return Eigen::Vector3f(x * half_m, y * half_m, height_m); };
  Points corners;
  add_quad(&corners, at(-1, -1), at(1, -1), at(1, 1), at(-1, 1));
  return mesh_of(corners, material);
}

/// A horizontal disc around the z axis, with the area of the exact circle.
inline relight::ReferenceMesh disc(float radius_m, float height_m, const relight::Material& material) {
  constexpr int kSides = 256;
  const float step = 2 * kPi / kSides;
  const float r = radius_m * std::sqrt(step / std::sin(step));
  const auto at = [&](int i) {
    const float phi = step * static_cast<float>(i % kSides);
    return Eigen::Vector3f(r * std::cos(phi), r * std::sin(phi), height_m);
  };
  Points corners;
  for (int i = 0; i < kSides; ++i) {
    for (const Eigen::Vector3f& p : {Eigen::Vector3f(0, 0, height_m), at(i), at(i + 1)}) corners.push_back(p);
  }
  return mesh_of(corners, material);
}

inline relight::ReferenceMesh ball(float radius_m, const Eigen::Vector3f& centre_m, const relight::Material& material) {
  relight::ReferenceMesh mesh = mesh_of(sphere(radius_m, 24), material);
  mesh.T_tag_model.translation() = centre_m;
  return mesh;
}

inline relight::ReferenceLamp bulb(const Eigen::Vector3f& centre_m, float radius_m, float radiance) {
  relight::ReferenceLamp lamp;
  lamp.centre_m = centre_m;
  lamp.radius_m = radius_m;
  lamp.radiance.setConstant(radiance);
  return lamp;
}

/// A panel that emits downwards.
inline relight::ReferenceLamp panel(const Eigen::Vector3f& centre_m, float half_x_m, float half_y_m, float radiance) {
  relight::ReferenceLamp lamp = bulb(centre_m, 0, radiance);
  lamp.shape = relight::ReferenceLamp::Shape::rectangle;
  lamp.half_u_m = {half_x_m, 0, 0};
  lamp.half_v_m = {0, half_y_m, 0};
  return lamp;
}

inline relight::ReferenceLamp round_panel(const Eigen::Vector3f& centre_m, float radius_m, float radiance) {
  relight::ReferenceLamp lamp = bulb(centre_m, radius_m, radiance);
  lamp.shape = relight::ReferenceLamp::Shape::disc;
  return lamp;
}

/// A camera at one point, directed at another, where the image is `width_m` wide.
inline relight::PosedCamera looking(const Eigen::Vector3f& from_m, const Eigen::Vector3f& to_m, float width_m,
                                    int width, int height) {
  relight::PosedCamera camera;
  camera.model.width = width;
  camera.model.height = height;
  camera.model.fx = camera.model.fy = static_cast<double>(width) * (to_m - from_m).norm() / width_m;
  camera.model.cx = 0.5 * (width - 1);
  camera.model.cy = 0.5 * (height - 1);
  const Eigen::Vector3f forward = (to_m - from_m).normalized();
  const Eigen::Vector3f right = forward.cross(Eigen::Vector3f::UnitZ()).normalized();
  camera.T_tag_camera.linear() << right, forward.cross(right), forward;
  camera.T_tag_camera.translation() = from_m;
  return camera;
}

inline relight::ReferenceSamples samples_of(int per_pixel, std::uint32_t seed = 0) {
  relight::ReferenceSamples samples;
  samples.per_pixel = per_pixel;
  samples.seed = seed;
  return samples;
}

inline relight::DeltaPathTracer tracer_of(const relight::ReferenceScene& scene) {
  return relight::DeltaPathTracer(std::make_shared<const relight::ReferenceScene>(scene));
}

/// Mean of one channel over all pixels.
inline double mean(const capture::Image<float>& image, int channel = 0) {
  double sum = 0;
  const auto step = static_cast<std::size_t>(image.channels);
  for (std::size_t i = static_cast<std::size_t>(channel); i < image.data.size(); i += step) sum += image.data[i];
  return sum * image.channels / static_cast<double>(image.data.size());
}

}  // namespace lumigraft::test
