#include "relight/passes/lamps/lamp_maps.h"

#include <algorithm>
#include <array>
#include <cmath>

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
      bound_(device.create_compute("lamp_bounds.comp")) {
  const int maps = max_maps + max_lamps;
  depths_ = device.create_texture({.name = "lamp maps",
                                   .width = kColumns * edge,
                                   .height = rows_of(maps) * edge,
                                   .format = gpu::Format::depth32_float,
                                   .attachment = true});
  views_ = device.create_buffer(sizeof(shader::LampMap) * static_cast<std::size_t>(maps), "views of lamp maps");
  bounds_ = device.create_buffer(sizeof(std::uint32_t) * static_cast<std::size_t>(maps * bounds_of(edge)),
                                 "bounds of lamp maps");
}

void LampMaps::choose(gpu::Device& device, shader::FrameParams& params) {
  std::vector<shader::LampMap> views;
  draws_.clear();
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
    }
  }
  if (!views.empty()) device.upload(*views_, 0, std::as_bytes(std::span(views)));
}

void LampMaps::record(gpu::CommandList& list, const std::vector<PlacedObject>& objects, bool rough,
                      const gpu::Texture& white) const {
  ObjectDraws draws;
  for (const shader::DrawParams& view : draws_) {
    for (const PlacedObject& object : objects) {
      draws.add(rough ? object.stored->rough : object.stored->simple, object.T_tag_model, object.material,
                object.white_radiance, 0, view, white);
    }
  }
  for (gpu::DrawCall& call : draws.calls) call.bindings.clear();
  list.draw(*raster_, {}, *depths_, draws.calls);
  if (draws_.empty()) return;
  list.dispatch(*bound_, bindings(), {}, edge_ / kBoundTile, edge_ / kBoundTile, static_cast<int>(draws_.size()));
}

std::vector<gpu::Binding> LampMaps::bindings() const {
  return {gpu::sampled(7, *depths_), gpu::storage(8, *views_), gpu::storage(11, *bounds_)};
}

}  // namespace lumigraft::relight
