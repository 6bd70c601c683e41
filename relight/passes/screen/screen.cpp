#include "relight/passes/screen/screen.h"

#include "relight/passes/parameters.h"

namespace lumigraft::relight {
Screen::Screen(gpu::Device& device, int width_px, int height_px, int trace_scale, int coarse_shadows,
               int coarse_ambient, int samples, int lamps)
    : width(width_px),
      height(height_px),
      scale(trace_scale),
      shadow_scale(coarse_shadows),
      ambient_scale(coarse_ambient),
      supersampling(samples),
      max_lamps(lamps) {
  using gpu::Format;
  const auto make = [&](const char* name, Format format, int w, int h, bool attachment = false) {
    return device.create_texture({.name = name, .width = w, .height = h, .format = format, .attachment = attachment});
  };
  const auto full = [&](const char* name, Format format) { return make(name, format, width, height); };
  const auto coarse = [&](const char* name, int s, int layers = 1) {
    return make(name, Format::rgba16_float, (width + s - 1) / s, layers * ((height + s - 1) / s));
  };
  fine_step = width >= kPasses.fine_picture_px ? 2 : 1;
  tiles = std::make_unique<Tiles>(device, width, height, shadow_scale, scale, ambient_scale, fine_step);
  rays = full("rays", Format::rg32_float);
  codes = device.create_texture(
      {.name = "camera codes", .width = width, .height = height, .format = Format::rgba8_unorm, .host_written = true});
  radiance = full("camera radiance", Format::rgba32_float);
  depth = full("depth", Format::r32_float);

  const auto target = [&](const char* name, Format format, int s) {
    return make(name, format, s * width, s * height, true);
  };
  sample_normal = target("object normals", Format::rgba16_float, supersampling);
  sample_base = target("object base colours", Format::rgba16_float, supersampling);
  sample_depth = target("object depths", Format::rg32_float, supersampling);
  sample_emission = target("object emission", Format::rgba16_float, supersampling);
  lit_samples = target("lit objects", Format::rgba16_float, supersampling);
  sample_z = target("object z buffer", Format::depth32_float, supersampling);
  known_normal = target("known normals", Format::rgba16_float, 1);
  known_base = target("known base colours", Format::rgba16_float, 1);
  known_depth = target("known depths", Format::rg32_float, 1);
  known_z = target("known z buffer", Format::depth32_float, 1);

  object_normal = full("object normal", Format::rgba16_float);
  object_base = full("object base", Format::rgba16_float);
  object_surface = full("object surface", Format::rgba32_float);
  object_other = full("other object surface", Format::rgba16_float);
  object_emission = full("object emission, resolved", Format::rgba16_float);
  object_irradiance = coarse("object irradiance", ambient_scale);
  object_mirrored = coarse("object mirrored", ambient_scale);
  object_open = coarse("object open", ambient_scale, (max_lamps + 3) / 4);
  object_radiance = full("object radiance", Format::rgba16_float);
  real_position = full("real position", Format::rgba32_float);
  real_normal = full("real normal", Format::rgba16_float);
  real_albedo = full("real albedo", Format::rgba16_float);
  shadowed = coarse("shadowed", shadow_scale);
  direct_lost = full("direct lost", Format::rgba16_float);
  mirror_lost = full("mirror lost", Format::rgba16_float);
  mirror_all = full("mirror all", Format::rgba16_float);
  traced = coarse("traced", scale);
  indirect = full("indirect", Format::rgba16_float);
  gain = coarse("gain", kPasses.smooth_px);
  live_gain = coarse("fine gain", fine_step);
  mirror_gained = full("mirror gained", Format::rgba16_float);
  mirror_fraction = full("mirror fraction", Format::rgba16_float);
  mirror_gained_smooth = full("mirror gained, smooth", Format::rgba16_float);
  mirror_fraction_smooth = full("mirror fraction, smooth", Format::rgba16_float);
  object_layer = full("objects", Format::rgba16_float);
  object_z = full("object depths", Format::r32_float);
  delta = full("delta", Format::rgba32_float);
  room_radiance = full("room_radiance", Format::rgba16_float);
}

std::optional<gpu::Area> Screen::object_area() const {
  const Eigen::AlignedBox2i covered = tiles->covered();
  if (covered.isEmpty()) return std::nullopt;
  const Eigen::Vector2i low = kTile_px * covered.min();
  const Eigen::Vector2i high = (kTile_px * (covered.max().array() + 1)).min(Eigen::Array2i(width, height));
  return gpu::Area{supersampling * low.x(), supersampling * low.y(), supersampling * (high - low).x(),
                   supersampling * (high - low).y()};
}

}  // namespace lumigraft::relight
