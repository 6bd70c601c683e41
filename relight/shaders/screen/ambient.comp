#version 460
#extension GL_GOOGLE_include_directive : require
// Slowly varying light on the virtual objects, at 1/scale of the image: the visible fraction of every lamp, by shadow
// cones through real and virtual surfaces, and all light except lamps (thesis eq. 5.23-5.24), by cones over the
// hemisphere, and along the lobe where it is broad. pass_i.x: scale.
#include "screen/object_pixel.glsl"
#include "volume/lamp_visibility.glsl"
#include "common/half.glsl"
#include "common/tiles.glsl"
layout(binding = 16, rgba16f) uniform writeonly image2D out_irradiance;  // a: pixel in the block, plus 1; 0: none
layout(binding = 17, rgba16f) uniform writeonly image2D out_mirrored;    // radiance
layout(binding = 18, rgba16f) uniform writeonly image2D out_open;  // visible share of lamps 0 to 3, below it of 4 to 7

void main() {
  int scale = frame.pass_i.x, block = -1;
  ivec2 cell = tile_texel(), at = cell;
  if (any(greaterThanEqual(cell, imageSize(out_irradiance)))) return;
  float max_coverage = 0.0;
  for (int i = 0; i < scale * scale; ++i) {  // select the pixel with the highest object coverage
    ivec2 q = min(scale * cell + ivec2(i % scale, i / scale), frame.picture.xy - 1);
    float coverage = texelFetch(object_surface, q, 0).y;
    if (coverage > max_coverage) {
      max_coverage = coverage;
      block = i;
      at = q;
    }
  }
  vec3 e = vec3(0), m = vec3(0);
  if (block >= 0) {
    ObjectPixel o = object_pixel(at);
    float turn = pixel_turn(cell);
    int stride = scale > 1 && frame.counts.w > 1 ? 2 : 1;  // alternating, as in shadow.comp
    vec4 open = vec4(0);
    for (int l = 0; l < frame.counts.x; ++l) {
      open[l & 3] = lamp_visibility(o.p, o.n, o.from_real, o.from_virtual, frame.lamps[l], (cell.x + cell.y) % stride, stride).y;
      if ((l & 3) < 3 && l + 1 < frame.counts.x) continue;
      imageStore(out_open, cell + ivec2(0, (l >> 2) * imageSize(out_irradiance).y), to_half(open));
      open = vec4(0);
    }
    if (o.metallic < 1.0) e = gather_rho(o.from_real, o.from_virtual, o.n, frame.counts.z, turn);
    if (o.mirror && (scale == 1 || o.bsdf.alpha >= kBroadLobe)) m = mirrored(o, turn);
  }
  imageStore(out_irradiance, cell, to_half(vec4(e, float(block + 1))));
  imageStore(out_mirrored, cell, to_half(vec4(m, 0.0)));
}
