#pragma once
// A camera in which a bright floor clips, and a shadow on it.
#include <algorithm>
#include <array>
#include <cmath>

#include "capture/camera/srgb.h"
#include "tests/relight/closed_form/closed_scene.h"

namespace lumigraft::test {

/// A box on a bright floor under a lamp.
inline ClosedScene bright_floor() {
  ClosedScene scene = box_on_floor();
  scene.albedo = 0.8f;
  scene.radiance = [scene](const Eigen::Vector3f& p) {
    const float sky = static_cast<float>(M_PI) * scene.sky;
    return scene.albedo / static_cast<float>(M_PI) * (sky + irradiance(scene.lamps[0], p, Eigen::Vector3f::UnitZ()));
  };
  return scene;
}

/// The frame as a camera that clips takes it. `gain`: by channel.
inline capture::FrameSet encoded(capture::FrameSet frame, float exposure,
                                 const std::array<float, 3>& gain = {1, 1, 1}) {
  auto color = std::make_shared<capture::Frame>();
  const capture::Image<float>& light = frame.color->radiance;
  color->exposure = exposure;
  color->encoded = capture::Image<std::uint8_t>(light.width, light.height, 3);
  for (std::size_t i = 0; i < light.data.size(); ++i)
    color->encoded.data[i] =
        static_cast<std::uint8_t>(std::lround(255 * capture::linear_to_srgb(exposure * gain[i % 3] * light.data[i])));
  frame.color = std::move(color);
  frame.color_gain = {gain[0], gain[1], gain[2]};
  return frame;
}

/// Where the radiance clips, the field has a lower bound.
inline reconstruct::Scene with_bounds(reconstruct::Scene scene, float clip) {
  auto field = std::make_shared<reconstruct::DistanceField>(*scene.field);
  for (const auto& [key, brick] : scene.field->bricks) {
    auto seen = std::make_shared<reconstruct::FieldBrick>(*brick);
    reconstruct::BrickColor& color = seen->own_color();
    for (std::size_t i = 0; i < reconstruct::kBrickVoxels; ++i) {
      if (color.radiance[i].maxCoeff() < clip) continue;
      color.radiance[i] = color.radiance[i].cwiseMin(clip);
      color.weight[i] = 0;
    }
    field->bricks[key] = std::move(seen);
  }
  scene.field = std::move(field);
  return scene;
}

/// The shadow of an object on a floor that clips, by a renderer that sees it unlimited, and by one whose camera clips.
struct ClippedShadow {
  double error = 0;  ///< RMS over that of the change from white, of pixels that clip and are shadowed
  int shadowed = 0, brightest_changed = 0;  ///< pixels; those of the others that clip and are not white any more
};

inline ClippedShadow clipped_shadow(relight::Renderer& unlimited, relight::Renderer& clipping,
                                    const relight::Plan& plan) {
  const ClosedScene scene = bright_floor();
  const capture::FrameSet linear = scene.frame();
  const relight::RelitPicture exact = unlimited.relight(linear, scene.scene(), scene.exhibit, plan, true);
  constexpr float kOver = 1.6f;  // times the range, at the brightest place
  const float brightest = *std::max_element(linear.color->radiance.data.begin(), linear.color->radiance.data.end());
  const float exposure = kOver / brightest;
  const relight::RelitPicture picture =
      clipping.relight(encoded(linear, exposure), with_bounds(scene.scene(), 1 / exposure), scene.exhibit, plan, true);
  ClippedShadow result;
  double squares = 0, change = 0;
  for (std::size_t i = 0; i < linear.color->radiance.data.size(); i += 3) {
    const float light = exposure * linear.color->radiance.data[i], delta = exposure * exact.maps->delta.data[i];
    if (exact.maps->mask.data[i / 3] > 0) continue;
    if (light > 1.1f && light + delta > 1.05f) result.brightest_changed += picture.srgb.data[i] < 250;
    if (light < 1.02f || light + delta > 0.9f) continue;
    const double found = capture::srgb_to_linear(static_cast<float>(picture.srgb.data[i]) / 255);
    squares += std::pow(found - (light + delta), 2);
    change += std::pow(1 - (light + delta), 2);
    ++result.shadowed;
  }
  result.error = std::sqrt(squares / change);
  return result;
}

}  // namespace lumigraft::test
