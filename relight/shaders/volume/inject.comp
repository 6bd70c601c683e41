#version 460
#extension GL_GOOGLE_include_directive : require
// Split-inject (thesis §5.4.1): a texel of the lamp's view of the objects creates a positive light on the virtual
// surface and a negative one on the real surface that it occludes from the lamp. Each is split over the 8 nearest
// voxels of both cascades as reflected flux. Virtual surfaces inject into the voxels in front of them (see
// volume.glsl). pass_i.x: the lamp; pass_f.x: 1 / tan of the half angle of its view.
#include "volume/volume.glsl"
#include "volume/inject_flux.glsl"
#include "common/lamp.glsl"
layout(local_size_x = 8, local_size_y = 8) in;
layout(binding = 12) uniform sampler2D hit_position;
layout(binding = 13) uniform sampler2D hit_albedo;
layout(binding = 18) uniform sampler2D hit_normal;
layout(binding = 14) uniform sampler3D real_albedo;
layout(std430, binding = 16) buffer VirtualFlux { int virtual_flux[]; };  // chunk, voxel, channel
layout(std430, binding = 17) buffer RealFlux { int real_flux[]; };

INJECT(inject_virtual, kVirtual, virtual_flux)
INJECT(inject_real, kReal, real_flux)

void main() {
  ivec2 size = textureSize(hit_position, 0), at = ivec2(gl_GlobalInvocationID.xy);
  if (any(greaterThanEqual(at, size))) return;
  vec4 hit = texelFetch(hit_position, at, 0);
  if (hit.a == 0.0) return;
  Lamp lamp = frame.lamps[frame.pass_i.x];
  vec3 from = lamp.position_radius.xyz, to = hit.xyz - from;
  float far = length(to);
  vec3 w = to / far;

  // If a real surface is between the lamp and the object, nothing changes along this ray.
  vec2 known = ray_box(from, w, grid_low(frame.cascade[1]), cascade_high(1));
  float min_step = 0.5 * frame.cascade[0].w;
  float t = max(known.x + frame.cascade[1].w, 0.0), end = min(known.y, far - 1.5 * frame.cascade[0].w);
  for (int i = 0; i < 128 && t < end; ++i) {
    float d = real_distance(from + t * w);
    if (d < 0.0) return;
    t += max(d, min_step);
  }

  // The texel's solid angle: a square of edge 2 tan / size at distance 1, times the cosine factors.
  vec2 q = (2.0 * (vec2(at) + 0.5) / vec2(size) - 1.0) / frame.pass_f.x;
  float edge = 2.0 / (frame.pass_f.x * float(size.x)), slant = inversesqrt(1.0 + dot(q, q));
  vec3 flux = lamp.intensity.rgb * emission(lamp, w) * edge * edge * slant * slant * slant;
  vec3 n = texelFetch(hit_normal, at, 0).xyz;
  inject_virtual(hit.xyz, kFront * (dot(n, w) > 0.0 ? -n : n), flux * texelFetch(hit_albedo, at, 0).rgb);

  t = far + min_step;
  for (int i = 0; i < 128 && t < known.y; ++i) {
    vec3 p = from + t * w;
    float d = real_distance(p);
    if (d < 0.1 * min_step) {
      vec4 albedo = real_at(real_albedo, in_cascade(0, p, 1.0) ? 0 : 1, p);
      if (albedo.a > 0.05) inject_real(p, vec3(0), -frame.blocked.rgb * flux * albedo.rgb / albedo.a);
      return;
    }
    t += max(d, 0.5 * min_step);
  }
}
