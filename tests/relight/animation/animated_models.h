#pragma once
// Models whose animations have closed forms.
#include <cmath>
#include <memory>
#include <utility>
#include <vector>

#include "relight/exhibit/exhibit.h"

namespace lumigraft::test {

inline relight::AnimatedValue value_of(std::size_t width, std::vector<float> times_s, std::vector<float> numbers,
                                       relight::Interpolation interpolation = relight::Interpolation::linear) {
  relight::AnimatedValue value;
  value.interpolation = interpolation;
  value.width = width;
  value.times_s = std::move(times_s);
  value.values = std::move(numbers);
  return value;
}

inline relight::Rig::Channel channel_of(relight::Rig::Moves moves, std::uint32_t node, relight::AnimatedValue value) {
  return {moves, node, 0, std::move(value)};
}

/// A quarter turn about z in the first second.
inline relight::AnimatedValue quarter_turn() {
  const float half = std::sqrt(0.5f);
  return value_of(4, {0, 1}, {0, 0, 0, 1, 0, 0, half, half});
}

/// The model with all of its vertices on one node that an animation of these channels moves.
inline std::shared_ptr<relight::Model> on_a_node(relight::Model model, std::vector<relight::Rig::Channel> channels) {
  auto rig = std::make_shared<relight::Rig>();
  rig->nodes.emplace_back();
  rig->bones.emplace_back();
  rig->animations.push_back({"moves", channels.front().value.times_s.back(), std::move(channels)});
  for (std::uint32_t v = 0; v < model.positions_m.size(); ++v) {
    rig->vertices.push_back({model.positions_m[v], model.normals[v]});
    rig->influences.emplace_back();
    rig->first_influence.push_back(v + 1);
    rig->first_morph.push_back(0);
    model.sources.push_back(v);
  }
  model.rig = std::move(rig);
  return std::make_shared<relight::Model>(std::move(model));
}

/// Two bones of a metre each along x, the second of which turns by a quarter about z at x = 1. Vertices on the x axis,
/// with the weights of the second bone; those of the first are the rest.
inline relight::Rig arm(const std::vector<std::pair<float, float>>& vertices) {
  relight::Rig rig;
  rig.nodes.resize(2);
  rig.nodes[1].parent = 0;
  rig.nodes[1].translation_m = Eigen::Vector3f::UnitX();
  rig.nodes[1].T_parent_node = Eigen::Translation3f(1, 0, 0);
  rig.bones.resize(2);
  rig.bones[1] = {1, Eigen::Affine3f(Eigen::Translation3f(-1, 0, 0))};
  rig.animations.push_back({"bends", 1, {channel_of(relight::Rig::Moves::rotation, 1, quarter_turn())}});
  for (const auto& [x, weight] : vertices) {
    rig.vertices.push_back({{x, 0, 0}, Eigen::Vector3f::UnitY()});
    rig.influences.push_back({0, 1 - weight});
    rig.influences.push_back({1, weight});
    rig.first_influence.push_back(static_cast<std::uint32_t>(rig.influences.size()));
    rig.first_morph.push_back(0);
  }
  return rig;
}

}  // namespace lumigraft::test
