#include "relight/passes/screen/lamp_shadows.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "relight/passes/parameters.h"

namespace lumigraft::relight {
namespace {

/// A sphere that contains the sphere around the objects, and is constant under their rotation and jitter.
Eigen::Vector4f steady(const Eigen::Vector4f& sphere) {
  // Quantized to sixteenths of an octave; the offset of a third keeps round numbers away from the border between two.
  const float radius = std::exp2((std::ceil(16 * std::log2(sphere.w()) - 1.0f / 3) + 1.0f / 3) / 16);
  const float step = kPasses.steady_step * radius;
  Eigen::Vector4f result;
  result << (sphere.head<3>() / step).array().round().matrix() * step, radius * (1 + 0.87f * kPasses.steady_step);
  return result;
}

/// Half angle of the sphere around the objects and of the surrounding penumbra, as far as the volumes reach.
float half_angle_rad(const shader::FrameParams& frame, const shader::Lamp& lamp) {
  const Eigen::Vector4f sphere = steady(frame.sphere);
  const float far = (sphere.head<3>() - lamp.position_radius.head<3>()).norm();
  if (far < 1.02f * sphere.w()) return 3;
  const float beyond = 0.5f * static_cast<float>(frame.grid.x()) * frame.cascade[1].w();
  const float penumbra = lamp.position_radius.w() * beyond / (far * (far + beyond));
  return std::asin(sphere.w() / far) + std::atan(penumbra);
}

}  // namespace

LampShadows::LampShadows(gpu::Device& device, int edge_px, int max_lamps)
    : edge_(std::min(edge_px, kPasses.max_texture_px / max_lamps / kPasses.block_px * kPasses.block_px)),
      blocks_(edge_ / kPasses.block_px),
      ground_(device.create_compute("shadow_receiver_map.comp")),
      tiles_(device.create_compute("lamp_tiles.comp")),
      shadow_(device.create_compute("lamp_shadow.comp")),
      hiding_(device.create_buffer(
          sizeof(std::uint32_t) * 2 * static_cast<std::size_t>(blocks_ * blocks_) * static_cast<std::size_t>(max_lamps),
          "maps that hide ground")) {
  const auto make = [&](const char* name, gpu::Format format) {
    return device.create_texture({.name = name, .width = edge_, .height = edge_ * max_lamps, .format = format});
  };
  ground_place_ = make("where lamps' light ends", gpu::Format::rgba32_float);
  ground_normal_ = make("normals there", gpu::Format::rgba16_float);
  shadows_ = make("lamp shadows", gpu::Format::rgba16_float);
}

bool LampShadows::possible(const shader::FrameParams& params) {
  return std::all_of(params.lamps, params.lamps + params.counts.x(),
                     [&](const shader::Lamp& lamp) { return half_angle_rad(params, lamp) < kPasses.widest_rad; });
}

void LampShadows::choose_views(shader::FrameParams& params) {
  for (int i = 0; i < params.counts.x(); ++i) {
    const shader::Lamp& lamp = params.lamps[i];
    const Eigen::Vector3f to = steady(params.sphere).head<3>() - lamp.position_radius.head<3>();
    const Eigen::Vector3f z = to.normalized(), x = z.unitOrthogonal(), y = z.cross(x);
    const float tan_half = std::tan(std::min(half_angle_rad(params, lamp), kPasses.widest_rad));
    shader::ShadowView& view = params.shadow_views[i];
    view.x_scale << x, 0.97f / tan_half;  // margin of a few texels
    view.y << y, 0;
    view.z_far << z, to.norm();
  }
}

void LampShadows::record(gpu::CommandList& list, const shader::FrameParams& params, const LampMaps& maps,
                         const LightVolumeState& room) {
  if (params.counts.x() == 0) return;
  const Volumes& volumes = room.volumes;
  const std::vector<gpu::Binding> distances{gpu::sampled(1, *volumes.virtual_distance, gpu::Filter::linear),
                                            gpu::sampled(2, *volumes.real_distance, gpu::Filter::linear)};
  std::vector<Eigen::Vector4f> views;
  for (int i = 0; i < params.counts.x(); ++i) {
    const shader::ShadowView& view = params.shadow_views[i];
    views.insert(views.end(), {view.x_scale, view.y, view.z_far, params.lamps[i].position_radius});
  }
  if (!ground_of_ || !(*ground_of_ == *room.real) || ground_views_ != views) {
    dispatch_2d(list, *ground_,
                joined(distances, {gpu::sampled(9, *volumes.real_normal, gpu::Filter::linear), volumes.chunks(),
                                   gpu::image(16, *ground_place_), gpu::image(17, *ground_normal_)}),
                params, edge_, edge_ * params.counts.x());
    ground_of_ = room.real;
    ground_views_ = std::move(views);
  }
  const std::vector<gpu::Binding> ground =
      joined(maps.bindings(), {gpu::sampled(9, *ground_place_), gpu::sampled(10, *ground_normal_)});
  dispatch_2d(list, *tiles_, joined(ground, {gpu::storage(16, *hiding_)}), params, blocks_,
              blocks_ * params.counts.x());
  dispatch_2d(list, *shadow_,
              joined(joined(ground, distances), {gpu::image(16, *shadows_), gpu::storage(17, *hiding_)}), params, edge_,
              edge_ * params.counts.x());
}

void LampShadows::read(gpu::Device& device, const shader::FrameParams& params) {
  const auto lamps = static_cast<std::size_t>(params.counts.x());
  views_.assign(params.shadow_views, params.shadow_views + lamps);
  lamps_m_.clear();
  for (std::size_t i = 0; i < lamps; ++i) lamps_m_.push_back(params.lamps[i].position_radius.head<3>());
  const auto edge = static_cast<std::size_t>(edge_), blocks = static_cast<std::size_t>(blocks_);
  shaded_.assign(lamps * blocks * blocks, 0);
  const std::vector<std::byte> bytes = device.download(*shadows_);
  const auto* texels = reinterpret_cast<const Eigen::half*>(bytes.data());
  for (std::size_t row = 0; row < lamps * edge; ++row) {
    const std::size_t lamp = row / edge;
    const int y = static_cast<int>(row % edge) / kPasses.block_px;
    for (std::size_t column = 0; column < edge; ++column) {
      if (static_cast<float>(texels[4 * (row * edge + column)]) < kPasses.min_fraction) continue;
      const int x = static_cast<int>(column) / kPasses.block_px;
      for (int v = std::max(y - 1, 0); v <= std::min(y + 1, blocks_ - 1); ++v) {
        for (int u = std::max(x - 1, 0); u <= std::min(x + 1, blocks_ - 1); ++u) {
          shaded_[(lamp * blocks + static_cast<std::size_t>(v)) * blocks + static_cast<std::size_t>(u)] = 1;
        }
      }
    }
  }
}

bool LampShadows::shades(const Eigen::Vector3f& at) const {
  for (std::size_t i = 0; i < views_.size(); ++i) {
    const shader::ShadowView& view = views_[i];
    const Eigen::Vector3f to = at - lamps_m_[i];
    const float z = to.dot(view.z_far.head<3>());
    if (z <= 0) continue;
    const float scale = view.x_scale.w() / z, u = to.dot(view.x_scale.head<3>()) * scale,
                v = to.dot(view.y.head<3>()) * scale;
    if (std::abs(u) >= 1 || std::abs(v) >= 1) continue;
    const auto block = [&](float q) { return static_cast<std::size_t>(0.5f * (q + 1) * static_cast<float>(blocks_)); };
    const auto blocks = static_cast<std::size_t>(blocks_);
    if (shaded_[(i * blocks + block(v)) * blocks + block(u)]) return true;
  }
  return false;
}

}  // namespace lumigraft::relight
