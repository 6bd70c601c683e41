#pragma once
// A skinned bar on the floor that bends by a quarter in a second, and the same bar rigid in one of its poses.
#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include "relight/animation/pose.h"
#include "relight/objects/mesh_refine.h"
#include "relight/objects/posed_model.h"
#include "tests/relight/animation/animated_models.h"
#include "tests/relight/closed_form/closed_scene.h"

namespace lumigraft::test {

/// Turns about y, at height 0.1 m: two bones, between which weights change over 6 cm.
inline relight::VirtualObject bending_bar(float albedo) {
  relight::VirtualObject bar = box_object({-0.03f, -0.04f, 0.01f}, {0.03f, 0.04f, 0.25f}, albedo);
  auto model = std::make_shared<relight::Model>(*relight::refine_model(*bar.model, 0.025f));
  const float half = std::sqrt(0.5f);
  auto rig = std::make_shared<relight::Rig>();
  rig->nodes.resize(2);
  rig->nodes[1].parent = 0;
  rig->nodes[1].translation_m = {0, 0, 0.1f};
  rig->nodes[1].T_parent_node = Eigen::Translation3f(0, 0, 0.1f);
  rig->bones.resize(2);
  rig->bones[1] = {1, Eigen::Affine3f(Eigen::Translation3f(0, 0, -0.1f))};
  rig->animations.push_back(
      {"bends",
       1,
       {channel_of(relight::Rig::Moves::rotation, 1, value_of(4, {0, 1}, {0, 0, 0, 1, 0, half, 0, half}))}});
  for (std::uint32_t v = 0; v < model->positions_m.size(); ++v) {
    rig->vertices.push_back({model->positions_m[v], model->normals[v]});
    const float weight = std::clamp((model->positions_m[v].z() - 0.07f) / 0.06f, 0.0f, 1.0f);
    rig->influences.push_back({0, 1 - weight});
    rig->influences.push_back({1, weight});
    rig->first_influence.push_back(static_cast<std::uint32_t>(rig->influences.size()));
    rig->first_morph.push_back(0);
    model->sources.push_back(v);
  }
  model->rig = std::move(rig);
  bar.model = std::move(model);
  bar.name = "bar";
  bar.animation.emplace().loops = false;
  return bar;
}

inline ClosedScene bar_on_floor() {
  ClosedScene scene = box_on_floor();
  scene.exhibit.objects = {bending_bar(0.9f)};
  return scene;
}

inline capture::FrameSet at(capture::FrameSet frame, double time_s) {
  frame.time_ns = static_cast<std::int64_t>(std::lround(time_s * 1e9));
  return frame;
}

/// Its pose at a time as a model without animation.
inline relight::Exhibit rigid(relight::Exhibit exhibit, double time_s) {
  for (relight::VirtualObject& object : exhibit.objects) {
    auto model = std::make_shared<relight::Model>(*posed_model(object.model, object.pose(time_s)));
    model->rig.reset();
    model->sources.clear();
    object.model = std::move(model);
    object.animation.reset();
  }
  return exhibit;
}

inline double rms_of_codes(const capture::Image<std::uint8_t>& a, const capture::Image<std::uint8_t>& b) {
  double sum = 0;
  for (std::size_t i = 0; i < a.data.size(); ++i) sum += std::pow(a.data[i] - b.data[i], 2);
  return std::sqrt(sum / static_cast<double>(a.data.size()));
}

}  // namespace lumigraft::test
