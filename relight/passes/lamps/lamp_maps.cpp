#include "relight/passes/lamps/lamp_maps.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <numeric>
#include <span>
#include <utility>

#include "relight/passes/lamps/object_draw.h"
#include "relight/passes/parameters.h"

namespace lumigraft::relight {
namespace {

constexpr int kColumns = 8;  // maps per row of the atlas
constexpr float kGolden = 2.39996323f;

constexpr int kBoundTile = 32;  // texels along the edge of a group's area (shaders/lamps/lamp_bounds.comp)

/// Blocks of 4, 8, 16 and 32 texels in a map.
int bounds_of(int edge) {
  int blocks = 0;
  for (int block = 4; block <= kBoundTile; block *= 2) blocks += (edge / block) * (edge / block);
  return blocks;
}

gpu::RasterDesc map_raster() {
  gpu::RasterDesc raster = vertex_raster("lamp_map.vert", "lamp_map.frag", {});
  raster.attributes.resize(1);  // positions alone
  return raster;
}

gpu::RasterDesc moved_raster() {
  gpu::RasterDesc raster = map_raster();
  raster.vertex_stride_bytes = 3 * static_cast<int>(sizeof(float));
  return raster;
}

int rows_of(int maps) { return (maps + kColumns - 1) / kColumns; }

/// Numbers of maps that minimise the sum of the lamps' errors, each estimated as irradiance times penumbra width over
/// the squared number.
std::array<int, shader::kMaxLamps> map_counts(const shader::FrameParams& params, int max_maps) {
  std::array<float, shader::kMaxLamps> weights{};
  float sum = 1e-12f;
  for (int i = 0; i < params.counts.x(); ++i) {
    const shader::Lamp& lamp = params.lamps[i];
    const float far = (lamp.position_radius.head<3>() - params.sphere.head<3>()).norm();
    if (far < kPasses.min_lamp_radii * params.sphere.w()) continue;
    weights[i] = std::cbrt(lamp.intensity.head<3>().maxCoeff() / (far * far) * lamp.position_radius.w() / far) + 1e-9f;
    sum += weights[i];
  }
  std::array<int, shader::kMaxLamps> counts{};
  if (max_maps == 0) return counts;
  for (int i = 0; i < params.counts.x(); ++i) {
    if (weights[i] == 0) continue;
    const bool point = params.lamps[i].position_radius.w() <= 0;
    counts[i] = point ? 1 : std::max(static_cast<int>(static_cast<float>(max_maps) * weights[i] / sum), 1);
  }
  return counts;
}

}  // namespace

LampMaps::LampMaps(gpu::Device& device, int edge, int max_maps, int max_lamps)
    : edge_(edge),
      max_maps_(max_maps),
      raster_(device.create_raster(map_raster())),
      raster_moved_(device.create_raster(moved_raster())),
      bound_(device.create_compute("lamp_bounds.comp")),
      observed_(device) {
  const int maps = max_maps + max_lamps;
  depths_ = device.create_texture({.name = "lamp maps",
                                   .width = kColumns * edge,
                                   .height = 2 * rows_of(maps) * edge,
                                   .format = gpu::Format::depth32_float,
                                   .attachment = true});
  views_ = device.create_buffer(sizeof(shader::LampMap) * static_cast<std::size_t>(maps), "views of lamp maps");
  bounds_ = device.create_buffer(sizeof(std::uint32_t) * static_cast<std::size_t>(maps * bounds_of(edge)),
                                 "bounds of lamp maps");
}

void LampMaps::choose(gpu::Device& device, shader::FrameParams& params, const Model* moved) {
  take_moved(device, params, moved);
  std::vector<shader::LampMap> views;
  draws_.clear();
  draws_moved_.clear();
  const Eigen::Vector3f centre = params.sphere.head<3>();
  const float radius = params.sphere.w();
  const auto counts = map_counts(params, max_maps_);
  for (int l = 0; l < params.counts.x(); ++l) {
    shader::Lamp& lamp = params.lamps[l];
    const int count = counts[static_cast<std::size_t>(l)];
    lamp.intensity.w() = static_cast<float>(count);
    const Eigen::Vector3f axis = lamp.facing.w() > 0 ? Eigen::Vector3f(lamp.facing.head<3>())
                                                     : (centre - lamp.position_radius.head<3>()).normalized(),
                          x = axis.unitOrthogonal(), y = axis.cross(x);
    for (int i = 0; i < count; ++i) {
      // Points on the lamp's disc, by a sunflower spiral (Vogel 1979).
      const float r = count == 1 ? 0.0f : lamp.position_radius.w() * std::sqrt((i + 0.5f) / static_cast<float>(count));
      const float phi = kGolden * static_cast<float>(i);
      const Eigen::Vector3f from = lamp.position_radius.head<3>() + r * (std::cos(phi) * x + std::sin(phi) * y);

      const float far = (centre - from).norm(), sine = std::min(radius / far, 0.98f);
      const float inverse_tan = 0.98f * std::sqrt(1 - sine * sine) / sine;  // margin of one or two texels
      const Eigen::Matrix4f T_view_tag = view_along(from, (centre - from) / far);
      const Eigen::Matrix3f turn = T_view_tag.topLeftCorner<3, 3>();
      const float first = std::max(far - 1.1f * radius, 0.02f * radius), last = far + 1.1f * radius;
      const int column = static_cast<int>(views.size()) % kColumns, row = static_cast<int>(views.size()) / kColumns;

      shader::LampMap& view = views.emplace_back();
      view.from << from, static_cast<float>((static_cast<int>(views.size()) - 1) * bounds_of(edge_));
      view.x << inverse_tan * turn.row(0).transpose(), 0;
      view.y << inverse_tan * turn.row(1).transpose(), 0;
      view.z << turn.row(2).transpose(), 0;
      view.place << static_cast<float>(column * edge_), static_cast<float>(row * edge_), last / (last - first),
          last * first / (last - first);
      const float texels = 0.5f * inverse_tan * static_cast<float>(edge_);  // per unit of x / z
      view.more << static_cast<float>(edge_), far / texels,
          lamp.position_radius.w() / std::sqrt(static_cast<float>(count)) * texels, phi;

      shader::DrawParams& draw = draws_.emplace_back();
      draw.T_view_tag = T_view_tag;
      const Eigen::Array2f tiles(static_cast<float>(kColumns), static_cast<float>(depths_->desc().height / edge_));
      draw.projection << 1 / tiles.x(), 1 / tiles.y(), (2 * static_cast<float>(column) + 1) / tiles.x() - 1,
          (2 * static_cast<float>(row) + 1) / tiles.y() - 1;
      draw.more << view.place.z(), view.place.w(), inverse_tan, 0;
      if (moved_m_.empty()) continue;
      float near = far;
      for (int k = 0; k < 8; ++k)
        near =
            std::min(near, turn.row(2).dot(moved_box_.corner(static_cast<decltype(moved_box_)::CornerType>(k)) - from));
      near = std::max(0.99f * near, kPasses.min_moved_near * far);
      view.x.w() = near;
      view.y.w() = static_cast<float>(depths_->desc().height / 2);
      shader::DrawParams& below = draws_moved_.emplace_back(draw);
      below.T_tag_model.setIdentity();
      below.projection.w() += 1;  // half of the atlas
      below.more << 1, near, inverse_tan, 0;
    }
  }
  if (!views.empty()) device.upload(*views_, 0, std::as_bytes(std::span(views)));
}

void LampMaps::observe(gpu::Device& device, shader::FrameParams& params,
                       const std::shared_ptr<const reconstruct::LampShadows>& shadows,
                       const std::vector<int>& lamp_ids) {
  observed_.take(device, shadows, lamp_ids, params);
  moved_anew_ = moved_anew_ || observed_.changed();
}

bool LampMaps::may_occlude(const shader::FrameParams& params, const Eigen::Vector3f& p_m) {
  for (int l = 0; l < params.counts.x(); ++l) {
    const Eigen::Vector4f& lamp = params.lamps[l].position_radius;
    const Eigen::Vector3f to = params.sphere.head<3>() - lamp.head<3>(), of_p = p_m - lamp.head<3>();
    const float part = of_p.dot(to) / to.squaredNorm();  // of the distance to the sphere's centre
    if (!(part > 0)) continue;
    // A point of the lamp that is off by its radius sees p off by this at the centre.
    const float penumbra_m = lamp.w() * std::max(1 / part - 1, 0.0f);
    if ((of_p / part - to).norm() <= params.sphere.w() + penumbra_m) return true;
  }
  return false;
}

void LampMaps::take_moved(gpu::Device& device, const shader::FrameParams& params, const Model* moved) {
  std::vector<float> corners_m;
  moved_box_.setEmpty();
  for (std::size_t i = 0; moved && i + 2 < moved->indices.size(); i += 3) {
    const auto corner = [&](std::size_t k) -> const Eigen::Vector3f& {
      return moved->positions_m[moved->indices[i + k]];
    };
    if (!may_occlude(params, corner(0)) && !may_occlude(params, corner(1)) && !may_occlude(params, corner(2))) continue;
    for (std::size_t k = 0; k < 3; ++k) {
      corners_m.insert(corners_m.end(), corner(k).data(), corner(k).data() + 3);
      moved_box_.extend(corner(k));
    }
  }
  if (corners_m == moved_m_) return;
  moved_anew_ = true;
  moved_m_ = std::move(corners_m);
  if (moved_m_.empty()) return;
  std::vector<std::uint32_t> indices(moved_m_.size() / 3);
  std::iota(indices.begin(), indices.end(), 0u);
  const auto put = [&](std::unique_ptr<gpu::Buffer>& buffer, std::span<const std::byte> bytes, const char* name) {
    if (!buffer || buffer->size_bytes() < bytes.size()) buffer = device.create_buffer(2 * bytes.size(), name);
    device.upload(*buffer, 0, bytes);
  };
  put(corners_, std::as_bytes(std::span(moved_m_)), "moved surfaces");
  put(indices_, std::as_bytes(std::span(indices)), "triangles of moved surfaces");
}

void LampMaps::record(gpu::CommandList& list, const std::vector<PlacedObject>& objects, bool rough,
                      const gpu::Texture& white) {
  ObjectDraws draws;
  for (const shader::DrawParams& view : draws_) {
    for (const PlacedObject& object : objects) {
      draws.add(rough ? object.stored->rough : object.stored->simple, object.T_tag_model, object.material,
                object.white_radiance, 0, view, white);
    }
  }
  for (gpu::DrawCall& call : draws.calls) call.bindings.clear();
  const gpu::Area upper{0, 0, depths_->desc().width, depths_->desc().height / 2};
  list.draw(*raster_, {}, *depths_, draws.calls, &upper);
  record_moved(list);
  if (draws_.empty()) return;
  list.dispatch(*bound_, map_bindings(), {}, edge_ / kBoundTile, edge_ / kBoundTile, static_cast<int>(draws_.size()));
}

void LampMaps::record_moved(gpu::CommandList& list) {
  moved_anew_ = false;
  std::vector<gpu::DrawCall> calls;
  for (const shader::DrawParams& view : draws_moved_) {
    gpu::DrawCall& call = calls.emplace_back();
    call.params = gpu::bytes_of(view);
    call.vertices = corners_.get();
    call.indices = indices_.get();
    call.index_count = static_cast<std::uint32_t>(moved_m_.size() / 3);
  }
  const int rows = depths_->desc().height / 2;
  const gpu::Area lower{0, rows, depths_->desc().width, rows};
  if (!calls.empty()) list.draw(*raster_moved_, {}, *depths_, calls, &lower);
}

std::vector<gpu::Binding> LampMaps::map_bindings() const {
  return {gpu::sampled(7, *depths_), gpu::storage(8, *views_), gpu::storage(11, *bounds_)};
}

std::vector<gpu::Binding> LampMaps::bindings() const { return joined(map_bindings(), {observed_.binding()}); }

}  // namespace lumigraft::relight
