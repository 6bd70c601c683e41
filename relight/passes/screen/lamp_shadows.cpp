#include "relight/passes/screen/lamp_shadows.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstring>

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

constexpr std::size_t kViewVectors = 4;

/// By lamp, what its receivers depend on besides the room: its view, and its place last.
std::vector<Eigen::Vector4f> views_of(const shader::FrameParams& params) {
  std::vector<Eigen::Vector4f> views;
  for (int i = 0; i < params.counts.x(); ++i) {
    const shader::ShadowView& view = params.shadow_views[i];
    views.insert(views.end(), {view.x_scale, view.y, view.z_far, params.lamps[i].position_radius});
  }
  return views;
}

bool same_lamps(const std::vector<Eigen::Vector4f>& a, const std::vector<Eigen::Vector4f>& b) {
  bool same = a.size() == b.size();
  for (std::size_t i = kViewVectors - 1; same && i < a.size(); i += kViewVectors) same = a[i] == b[i];
  return same;
}

void set_views(const std::vector<Eigen::Vector4f>& views, shader::FrameParams& params) {
  for (std::size_t i = 0; kViewVectors * i < views.size(); ++i) {
    const Eigen::Vector4f* view = &views[kViewVectors * i];
    params.shadow_views[i] = {view[0], view[1], view[2]};
  }
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
      ground_receivers_(device.create_compute("shadow_receiver_map.comp")),
      tiles_(device.create_compute("lamp_tiles.comp")),
      shadow_(device.create_compute("lamp_shadow.comp")),
      hiding_(device.create_buffer(
          sizeof(std::uint32_t) * 2 * static_cast<std::size_t>(blocks_ * blocks_) * static_cast<std::size_t>(max_lamps),
          "maps that hide ground")),
      shaded_blocks_(device.create_buffer(
          sizeof(std::uint32_t) * static_cast<std::size_t>(blocks_ * blocks_) * static_cast<std::size_t>(max_lamps),
          "blocks with shadow")) {
  shadows_ = device.create_texture(
      {.name = "lamp shadows", .width = edge_, .height = edge_ * max_lamps, .format = gpu::Format::rgba16_float});
  ground_ = make_receivers(device);
}

LampShadows::Receivers LampShadows::make_receivers(gpu::Device& device) const {
  const auto make = [&](const char* name, gpu::Format format) {
    return device.create_texture({.name = name, .width = edge_, .height = shadows_->desc().height, .format = format});
  };
  Receivers made;
  made.place = make("where lamps' light ends", gpu::Format::rgba32_float);
  made.normal = make("normals there", gpu::Format::rgba16_float);
  return made;
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

void LampShadows::find_receivers(gpu::CommandList& list, shader::FrameParams params, int first_lamp, int lamps,
                                 const LightVolumeState& room, const Receivers& out) const {
  const Volumes& volumes = room.volumes;
  params.pass_i.x() = first_lamp;
  dispatch_2d(list, *ground_receivers_,
              {gpu::sampled(1, *volumes.virtual_distance, gpu::Filter::linear),
               gpu::sampled(2, *volumes.real_distance, gpu::Filter::linear),
               gpu::sampled(9, *volumes.real_normal, gpu::Filter::linear), volumes.chunks(), volumes.gone(),
               gpu::image(16, *out.place), gpu::image(17, *out.normal)},
              params, edge_, edge_ * lamps);
}

bool LampShadows::update_receivers(gpu::Device& device, gpu::CommandList& list, shader::FrameParams& params,
                                   const LightVolumeState& room) {
  const std::vector<Eigen::Vector4f> views = views_of(params);
  if (ground_.is_of(room, views, params.gone_cells.w())) {
    next_.of.reset();
  } else {
    if (!next_.place) next_ = make_receivers(device);
    // Objects that move on do not restart it, or it would never be done.
    if (!next_.of || !(*next_.of == *room.real) || !same_lamps(next_.views, views)) {
      next_.of = room.real;
      next_.views = views;
      next_.gone = params.gone_cells.w();
      next_lamp_ = 0;
    }
    const int lamps = params.counts.x();
    const int now = std::min((lamps + kPasses.receiver_frames - 1) / kPasses.receiver_frames, lamps - next_lamp_);
    shader::FrameParams of_next = params;
    set_views(next_.views, of_next);
    list.begin_pass("lamp shadows");
    find_receivers(list, of_next, next_lamp_, now, room, next_);
    next_lamp_ += now;
    if (next_lamp_ >= lamps) {
      std::swap(ground_, next_);
      next_.of.reset();
      ++receivers_;
    }
  }
  if (!ground_.of || !same_lamps(ground_.views, views)) return false;
  set_views(ground_.views, params);
  return true;
}

void LampShadows::record(gpu::CommandList& list, const shader::FrameParams& params, const LampMaps& maps,
                         const LightVolumeState& room) {
  recorded_ = receivers_;
  if (params.counts.x() == 0) return;
  const Volumes& volumes = room.volumes;
  const std::vector<gpu::Binding> distances{gpu::sampled(1, *volumes.virtual_distance, gpu::Filter::linear),
                                            gpu::sampled(2, *volumes.real_distance, gpu::Filter::linear),
                                            volumes.gone()};
  const std::vector<Eigen::Vector4f> views = views_of(params);
  if (!ground_.of || ground_.views != views ||
      !(updating_receivers() || ground_.is_of(room, views, params.gone_cells.w()))) {
    find_receivers(list, params, 0, params.counts.x(), room, ground_);
    ground_.of = room.real;
    ground_.views = views;
    ground_.gone = params.gone_cells.w();
    recorded_ = ++receivers_;
  }
  const std::vector<gpu::Binding> ground =
      joined(maps.bindings(), {gpu::sampled(9, *ground_.place), gpu::sampled(10, *ground_.normal)});
  dispatch_2d(list, *tiles_, joined(ground, {gpu::storage(16, *hiding_)}), params, blocks_,
              blocks_ * params.counts.x());
  list.fill(*shaded_blocks_, 0);
  shader::FrameParams of_shadows = params;
  of_shadows.pass_f.x() = kPasses.min_fraction;
  dispatch_2d(list, *shadow_,
              joined(joined(ground, distances),
                     {gpu::image(16, *shadows_), gpu::storage(17, *hiding_), gpu::storage(18, *shaded_blocks_)}),
              of_shadows, edge_, edge_ * params.counts.x());
}

void LampShadows::read(gpu::Device& device, const shader::FrameParams& params) {
  const auto lamps = static_cast<std::size_t>(params.counts.x());
  views_.assign(params.shadow_views, params.shadow_views + lamps);
  lamps_m_.clear();
  for (std::size_t i = 0; i < lamps; ++i) lamps_m_.push_back(params.lamps[i].position_radius.head<3>());
  const auto blocks = static_cast<std::size_t>(blocks_);
  shaded_.assign(lamps * blocks * blocks, 0);
  const std::vector<std::byte> bytes = device.download(*shaded_blocks_);
  std::vector<std::uint32_t> lit(bytes.size() / sizeof(std::uint32_t));
  std::memcpy(lit.data(), bytes.data(), bytes.size());
  for (std::size_t lamp = 0; lamp < lamps; ++lamp) {
    for (int y = 0; y < blocks_; ++y) {
      for (int x = 0; x < blocks_; ++x) {
        const std::size_t first = lamp * blocks * blocks;
        if (!lit[first + static_cast<std::size_t>(y * blocks_ + x)]) continue;
        for (int v = std::max(y - 1, 0); v <= std::min(y + 1, blocks_ - 1); ++v) {
          for (int u = std::max(x - 1, 0); u <= std::min(x + 1, blocks_ - 1); ++u) {
            shaded_[first + static_cast<std::size_t>(v * blocks_ + u)] = 1;
          }
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
