#version 460
#extension GL_GOOGLE_include_directive : require
// Receivers of every lamp's light: the first real surface along its rays, and the fraction of the light that passes
// other real surfaces before it. Depends on the room, the lamps and approximately on the objects' position, not on
// their rotation. pass_i.x: first lamp.
#include "volume/lamp_visibility.glsl"
#include "common/half.glsl"
layout(local_size_x = 8, local_size_y = 8) in;
const float kNowhere = 1e4;  // depth where a lamp's ray hits no surface
layout(binding = 9) uniform sampler3D real_normal_volume;
layout(binding = 16, rgba32f) uniform writeonly image2D out_place;  // tag frame; depth or kNowhere
layout(binding = 17, rgba16f) uniform writeonly image2D out_normal;  // fraction that passes

void main() {
  int edge = imageSize(out_place).x;
  ivec2 at = ivec2(gl_GlobalInvocationID.xy) + ivec2(0, frame.pass_i.x * edge);
  int lamp = at.y / edge;
  if (at.x >= edge || lamp >= frame.counts.x) return;
  ShadowView view = frame.shadow_views[lamp];
  Lamp source = frame.lamps[lamp];
  vec3 from = source.position_radius.xyz;
  vec2 q = (2.0 * (vec2(at.x, at.y - lamp * edge) + 0.5) / float(edge) - 1.0) / view.x_scale.w;
  vec3 w = normalize(q.x * view.x_scale.xyz + q.y * view.y.xyz + view.z_far.xyz);

  vec2 known = ray_box(from, w, grid_low(frame.cascade[1]), cascade_high(1));
  float min_step = 0.5 * frame.cascade[0].w, t = max(known.x + frame.cascade[1].w, 0.0);
  bool hit = false;
  for (int i = 0; i < 128 && t < known.y && !hit; ++i) {
    float d = real_distance(from + t * w);
    hit = d < 0.1 * min_step;
    t += hit ? 0.0 : max(d, 0.5 * min_step);
  }
  // On past what is gone, as in real_shadow.
  for (int j = 0; j < (frame.gone.w > 0.0 && hit ? 1 : 0); ++j) {
    hit = false;
    for (int i = 0; i < 128 && t < known.y && !hit; ++i) {
      vec3 at_t = from + t * w;
      float d = real_distance(at_t);
      hit = d < 0.1 * min_step && !is_gone(at_t, d);
      t += hit ? 0.0 : max(d, 0.5 * min_step);
    }
  }
  // Without a known surface the ray ends at the volumes' border; points beyond use the shadow from there.
  vec3 p = from + (hit ? t : max(known.y, view.z_far.w)) * w, n = -w;
  if (hit) {
    vec3 normal = real_at(real_normal_volume, in_cascade(0, p, 1.0) ? 0 : 1, p).xyz;
    if (dot(normal, normal) > 0.25) n = normalize(normal);
  }
  imageStore(out_place, at, vec4(p, hit ? dot(p - from, view.z_far.xyz) - view.z_far.w : kNowhere));
  imageStore(out_normal, at, to_half(vec4(n, lamp_open(cone_from_real(p, n), source, true))));
}
