// Cost of a frame with an object that moves over that with a simpler one, with live settings:
// - an animated one over a rigid one that turns, alone and beside one that stands still, of 20000 triangles each, at
//   320 × 240 pixels;
// - one of 50000 triangles with five textures of 2048² texels over one with their means, which both turn, at 640 × 480.
//
//   build/release/object_cost [METHOD...]
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <map>
#include <memory>
#include <numbers>
#include <string>
#include <vector>

#include "relight/gpu/backends.h"
#include "relight/relighter.h"
#include "relight/views/ray_renderer.h"
#include "tests/relight/animation/animated_models.h"
#include "tests/relight/closed_form/closed_scene.h"

namespace lumigraft::test {
namespace {

constexpr int kEdge = 100, kFineEdge = 158;  ///< of a ball's net
constexpr int kSettle = 30, kMeasured = 60;  ///< frames
constexpr int kTexels = 2048;                ///< along an edge
constexpr double kFrame_s = 1.0 / 30;

/// A ball of 2 edge² triangles, 18 cm high, standing on the floor.
relight::Model ball(int edge = kEdge) {
  relight::Model model;
  for (int i = 0; i <= edge; ++i) {
    for (int j = 0; j <= edge; ++j) {
      const double a = std::numbers::pi * i / edge, b = 2 * std::numbers::pi * j / edge;
      const Eigen::Vector3f n =
          Eigen::Vector3d(std::sin(a) * std::cos(b), std::sin(a) * std::sin(b), std::cos(a)).cast<float>();
      model.positions_m.push_back(0.09f * n + Eigen::Vector3f(0, 0, 0.1f));
      model.normals.push_back(n);
      model.texcoords.emplace_back(static_cast<float>(j) / static_cast<float>(edge),
                                   static_cast<float>(i) / static_cast<float>(edge));
      model.colors.emplace_back(1, 1, 1);
    }
  }
  const auto at = [edge](int i, int j) { return static_cast<std::uint32_t>(i * (edge + 1) + j); };
  for (int i = 0; i < edge; ++i) {
    for (int j = 0; j < edge; ++j) {
      if (i > 0) model.indices.insert(model.indices.end(), {at(i, j), at(i + 1, j), at(i, j + 1)});
      if (i + 1 < edge) model.indices.insert(model.indices.end(), {at(i, j + 1), at(i + 1, j), at(i + 1, j + 1)});
    }
  }
  relight::Model::Part part;
  part.material.specular = 0;
  part.index_count = static_cast<std::uint32_t>(model.indices.size());
  model.parts.push_back(part);
  return model;
}

/// With a skin of four joints at each vertex, of which one turns.
std::shared_ptr<const relight::Model> skinned_ball() {
  relight::Model model = ball();
  auto rig = std::make_shared<relight::Rig>();
  rig->nodes.resize(4);
  rig->bones.resize(4);
  for (std::uint32_t node = 1; node < 4; ++node) {
    rig->nodes[node].parent = static_cast<int>(node) - 1;
    rig->bones[node].node = node;
  }
  const float s = std::sin(0.15f), c = std::cos(0.15f);
  rig->animations.push_back(
      {"sways",
       2,
       {channel_of(relight::Rig::Moves::rotation, 3, value_of(4, {0, 1, 2}, {0, -s, 0, c, 0, s, 0, c, 0, -s, 0, c}))}});
  for (std::uint32_t v = 0; v < model.positions_m.size(); ++v) {
    rig->vertices.push_back({model.positions_m[v], model.normals[v]});
    const float up = model.positions_m[v].z() / 0.2f;
    for (std::uint32_t bone = 0; bone < 4; ++bone) rig->influences.push_back({bone, bone == 3 ? up : (1 - up) / 3});
    rig->first_influence.push_back(4 * (v + 1));
    rig->first_morph.push_back(0);
    model.sources.push_back(v);
  }
  model.rig = std::move(rig);
  return std::make_shared<relight::Model>(std::move(model));
}

/// Smooth noise between two values of each channel, with features of so many texels.
relight::TexturePicture noise(int texels, const std::array<int, 3>& low, const std::array<int, 3>& high) {
  auto picture = std::make_shared<capture::Image<std::uint8_t>>(kTexels, kTexels, 3);
  const auto at = [](int x, int y, int c) {
    return static_cast<double>((static_cast<unsigned>(x * 73 + y * 151 + c * 57) * 2654435761u) >> 16 & 255) / 255;
  };
  for (int y = 0; y < kTexels; ++y) {
    for (int x = 0; x < kTexels; ++x) {
      const int i = x / texels, j = y / texels;
      const double u = static_cast<double>(x % texels) / texels, v = static_cast<double>(y % texels) / texels;
      for (int c = 0; c < 3; ++c) {
        const double value = (1 - v) * ((1 - u) * at(i, j, c) + u * at(i + 1, j, c)) +
                             v * ((1 - u) * at(i, j + 1, c) + u * at(i + 1, j + 1, c));
        const auto k = static_cast<std::size_t>(c);
        picture->at(x, y, c) = static_cast<std::uint8_t>(std::lround(low[k] + value * (high[k] - low[k])));
      }
    }
  }
  return picture;
}

relight::VirtualObject turning(relight::Model model, float x_m) {
  relight::VirtualObject object;
  object.model = std::make_shared<relight::Model>(std::move(model));
  object.position_m.x() = x_m;
  for (int i = 0; i < 400; ++i) {
    object.motion.push_back({static_cast<double>(i) / 4, object.position_m,
                             Eigen::Quaterniond(Eigen::AngleAxisd(0.15 * i, Eigen::Vector3d::UnitZ()))});
  }
  return object;
}

/// Of glTF materials, with base colour, metallic and roughness, normals, emission and specular factor of pictures, or
/// with about their means.
relight::VirtualObject material_object(bool textured) {
  relight::Model model = ball(kFineEdge);
  relight::Model::Part& part = model.parts[0];
  part.material = {.base_color = {0.35f, 0.3f, 0.25f}, .metallic = 0.3f, .roughness = 0.5f, .gltf = true};
  part.material.emission.setConstant(0.02f);
  if (textured) {
    part.material.base_color.setOnes();
    part.material.emission.setConstant(0.1f);
    part.base_color_texture.picture = noise(4, {100, 90, 80}, {220, 210, 200});
    part.metallic_roughness_texture.picture = noise(16, {0, 90, 40}, {255, 170, 110});
    part.normal_texture.picture = noise(8, {110, 110, 230}, {146, 146, 255});
    part.emissive_texture.picture = noise(32, {0, 0, 0}, {255, 255, 255});
    part.specular_texture.picture = noise(16, {200, 200, 200}, {255, 255, 255});
  }
  return turning(std::move(model), 0);
}

relight::VirtualObject rigid_object(float x_m, bool turns) {
  if (turns) return turning(ball(), x_m);
  relight::VirtualObject object;
  object.model = std::make_shared<relight::Model>(ball());
  object.position_m.x() = x_m;
  return object;
}

relight::VirtualObject animated_object() {
  relight::VirtualObject object;
  object.model = skinned_ball();
  object.animation.emplace();
  return object;
}

struct Cost {
  double cpu_ms = 0, wall_ms = 0;  ///< mean; of all threads
  std::map<std::string, double> passes_ms;
};

Cost cost_of(relight::Renderer& renderer, const ClosedScene& scene, const relight::Plan& plan) {
  const reconstruct::Scene room = scene.scene();
  capture::FrameSet frame = scene.frame();
  Cost cost;
  for (int i = 0; i < kSettle + kMeasured; ++i) {
    frame.time_ns = std::llround(1e9 * kFrame_s * i);
    const auto begin = std::chrono::steady_clock::now();
    const std::clock_t cpu = std::clock();
    const relight::RelitPicture picture = renderer.relight(frame, room, scene.exhibit, plan);
    if (i < kSettle) continue;
    cost.cpu_ms += 1e3 * static_cast<double>(std::clock() - cpu) / CLOCKS_PER_SEC / kMeasured;
    cost.wall_ms +=
        std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count() / kMeasured;
    for (const relight::gpu::PassTime& pass : picture.passes) cost.passes_ms[pass.name] += pass.gpu_ms / kMeasured;
  }
  return cost;
}

Cost cost_of(const std::string& method, std::vector<relight::VirtualObject> objects, int width = 320) {
  ClosedScene scene = box_on_floor();
  scene.width = width;
  scene.height = width * 3 / 4;
  scene.focal_px = 0.8 * width;
  for (std::size_t i = 0; i < objects.size(); ++i) objects[i].name = std::to_string(i);
  scene.exhibit.objects = std::move(objects);
  if (method == "rays") {
    relight::RayRenderer renderer(scene.session());
    return cost_of(renderer, scene, rays_plan(8));
  }
  relight::Plan plan = live_plan();
  plan.method = method;
  relight::Relighter renderer(relight::gpu::create_device(relight::gpu::Backend::best, {}), scene.session());
  return cost_of(renderer, scene, plan);
}

void print(const char* what, const Cost& cost, double simple_ms) {
  std::printf("  %-28s %7.1f ms of processor time, %.2f times, %7.1f ms;", what, cost.cpu_ms, cost.cpu_ms / simple_ms,
              cost.wall_ms);
  for (const auto& [pass, ms] : cost.passes_ms) std::printf(" %s %.1f", pass.c_str(), ms);
  std::printf("\n");
  std::fflush(stdout);
}

void compare(const std::string& method) {
  std::printf("%s\n", method.c_str());
  const Cost rigid = cost_of(method, {rigid_object(0, true)});
  print("rigid, turns", rigid, rigid.cpu_ms);
  print("animated", cost_of(method, {animated_object()}), rigid.cpu_ms);
  const Cost two = cost_of(method, {rigid_object(0, true), rigid_object(0.22f, false)});
  print("rigid, turns, beside still", two, two.cpu_ms);
  print("animated beside still", cost_of(method, {animated_object(), rigid_object(0.22f, false)}), two.cpu_ms);
  const Cost plain = cost_of(method, {material_object(false)}, 640);
  print("one material", plain, plain.cpu_ms);
  print("five textures", cost_of(method, {material_object(true)}, 640), plain.cpu_ms);
}

}  // namespace
}  // namespace lumigraft::test

int main(int argc, char** argv) {
  std::vector<std::string> methods(argv + 1, argv + argc);
  if (methods.empty()) methods = {"rays", "dvct"};
  for (const std::string& method : methods) lumigraft::test::compare(method);
}
