#include "relight/passes/live_view.h"

#include <algorithm>
#include <array>

namespace lumigraft {
namespace {

std::vector<gpu::Binding> inputs(const Volumes& volumes, const Screen& screen) {
  using gpu::Filter;
  return {gpu::sampled(2, *volumes.real_distance, Filter::linear),
          gpu::sampled(7, *volumes.real_response, Filter::linear),
          gpu::sampled(8, *volumes.real_normal, Filter::linear),
          gpu::sampled(9, *volumes.real_irradiance, Filter::linear),
          gpu::sampled(25, *screen.rays),
          gpu::sampled(26, *screen.depth),
          gpu::sampled(27, *screen.codes)};
}

/// By how much a code value changes for a small change of the gain: the slope of the sRGB curve in 1 / 2.4 powers.
std::array<float, 256> code_slopes() {
  std::array<float, 256> slopes;
  for (std::size_t code = 0; code < slopes.size(); ++code) {
    const float value = static_cast<float>(code) / 255;
    slopes[code] = 255 * (value <= 0.04045f ? 2.4f * value : value + 0.055f);
  }
  return slopes;
}

void multiply(const Eigen::Vector3f& gain, std::uint8_t* codes, int pixels) {
  static const std::array<float, 256> slopes = code_slopes();
  const Eigen::Vector3f more = gain - Eigen::Vector3f::Ones();
  if (more.cwiseAbs().maxCoeff() * slopes[255] < 0.5f) return;  // no code changes
  for (int i = 0; i < 3 * pixels; ++i) {
    const float code = static_cast<float>(codes[i]) + slopes[codes[i]] * more[i % 3];
    codes[i] = static_cast<std::uint8_t>(std::clamp(code + 0.5f, 0.0f, 255.0f));
  }
}

}  // namespace

LiveView::LiveView(gpu::Device& device)
    : raster_(device.create_raster({.vertex_shader = "object_lit.vert",
                                    .fragment_shader = "object_lit.frag",
                                    .vertex_stride_bytes = kVertexFloats * static_cast<int>(sizeof(float)),
                                    .attributes = vertex_attributes(),
                                    .color_formats = {gpu::Format::rgba16_float}})),
      place_(device.create_compute("live_place.comp")),
      gain_(device.create_compute("live_gain.comp")),
      shadow_(device.create_compute("live_shadow.comp")),
      object_(device.create_compute("live_object.comp")),
      blend_(device.create_compute("live_blend.comp")) {}

void LiveView::draw_objects(gpu::CommandList& list, const shader::FrameParams& params,
                            const std::vector<PlacedObject>& objects, const ObjectLight& light,
                            const gpu::Texture& white, const Screen& screen) const {
  const std::optional<gpu::Area> area = screen.object_area();
  if (!area) return;
  ObjectDraws draws;
  const shader::DrawParams view = camera_view(params, screen.supersampling);
  for (std::size_t i = 0; i < objects.size(); ++i) {
    const std::size_t first = draws.calls.size();
    draws.add(objects[i].stored->simple, objects[i].T_tag_model, objects[i].material, static_cast<int>(i), view, white);
    for (std::size_t call = first; call < draws.calls.size(); ++call) {
      draws.calls[call].bindings.push_back(gpu::storage(2, light.of(i)));
    }
  }
  const gpu::Attachment color{screen.lit_samples.get()}, depth{screen.sample_z.get()};
  list.draw(*raster_, {&color, 1}, &depth, draws.calls, &*area);
}

void LiveView::place(gpu::CommandList& list, const shader::FrameParams& params, const Volumes& volumes,
                     const Screen& screen) const {
  dispatch_tiles(list, *place_, joined(inputs(volumes, screen), {gpu::image(12, *screen.real_position)}), params,
                 screen.tiles->objects());
}

void LiveView::compose(gpu::CommandList& list, shader::FrameParams params, const LampShadows& shadows, bool samples,
                       const Volumes& volumes, const Screen& screen) const {
  const std::vector<gpu::Binding> real = inputs(volumes, screen);
  const std::vector<gpu::Binding> fine =
      joined(real, {gpu::sampled(10, shadows.texture(), gpu::Filter::linear), gpu::image(12, *screen.picture)});
  dispatch_tiles(list, *shadow_, fine, params, screen.tiles->shaded_alone());
  if (samples) {
    dispatch_tiles(list, *object_, joined(fine, {gpu::sampled(11, *screen.lit_samples)}), params,
                   screen.tiles->objects());
  } else {
    dispatch_tiles(list, *blend_,
                   joined(fine, {gpu::sampled(11, *screen.object_radiance), gpu::sampled(13, *screen.object_surface)}),
                   params, screen.tiles->objects());
  }
  params.pass_i.x() = kSmoothStep;
  dispatch_tiles(list, *gain_, joined(real, {gpu::image(12, *screen.gain)}), params, screen.tiles->smooth());
}

void LiveView::apply_gain(gpu::Device& device, const Screen& screen, Image<std::uint8_t>* picture) {
  const std::vector<std::byte> bytes = device.download(*screen.gain);
  const auto* gain = reinterpret_cast<const Eigen::half*>(bytes.data());
  const int columns = screen.gain->desc().width;
  for (const std::uint32_t place : screen.tiles->smooth_places()) {
    const int left = kTile_px * static_cast<int>(place & 0xffff), top = kTile_px * static_cast<int>(place >> 16);
    for (int v = top; v < std::min(top + kTile_px, screen.height); ++v) {
      for (int u = left; u < std::min(left + kTile_px, screen.width); u += kSmoothStep) {
        const Eigen::half* g = gain + 4 * (static_cast<std::ptrdiff_t>(v / kSmoothStep) * columns + u / kSmoothStep);
        const Eigen::Vector3f k(static_cast<float>(g[0]), static_cast<float>(g[1]), static_cast<float>(g[2]));
        std::uint8_t* codes = &picture->data[3 * (static_cast<std::size_t>(v) * static_cast<std::size_t>(screen.width) +
                                                  static_cast<std::size_t>(u))];
        multiply(k, codes, std::min(kSmoothStep, screen.width - u));
      }
    }
  }
}

}  // namespace lumigraft
