#version 460
#extension GL_GOOGLE_include_directive : require
// One more bounce (thesis eq. 3.13, terms beyond T_delta_2): what the listed voxels of cascade pass_i.x gather from the
// volumes as they are. Virtual surfaces gather the changed scene and the environment, real ones the change alone.
#include "gather.glsl"
#include "half.glsl"
layout(local_size_x = 64) in;
layout(std430, binding = 16) readonly buffer List { uint count; uint voxels[]; };
layout(binding = 17) uniform sampler3D virtual_color;
layout(binding = 18, rgba16f) uniform writeonly image3D gathered_virtual;
layout(binding = 19, rgba16f) uniform writeonly image3D gathered_real;
layout(binding = 25, rgba16f) uniform readonly image3D albedo_real;
layout(binding = 26, rgba16f) uniform readonly image3D normal_real;

vec3 virtual_normal(vec3 p) {
  float h = frame.virtual_grid.w;
  vec3 g = vec3(virtual_distance(p + vec3(h, 0, 0)) - virtual_distance(p - vec3(h, 0, 0)),
                virtual_distance(p + vec3(0, h, 0)) - virtual_distance(p - vec3(0, h, 0)),
                virtual_distance(p + vec3(0, 0, h)) - virtual_distance(p - vec3(0, 0, h)));
  return g / max(length(g), 1e-9);
}

void main() {
  uint listed = min(count, uint(voxels.length()));
  int cones = max(frame.counts.z, 9);
  for (uint i = gl_GlobalInvocationID.x; i < listed; i += gl_NumWorkGroups.x * 64u) {
    uint packed = voxels[i];
    ivec3 at = ivec3(packed & 511u, packed >> 9 & 511u, packed >> 18 & 511u);
    vec4 cascade = frame.cascade[frame.pass_i.x];
    vec3 p = cascade.xyz + cascade.w * vec3(at);
    float turn = fract(dot(vec3(at), vec3(0.8191725, 0.6710436, 0.5497005)));  // R3 sequence (Roberts 2018)
    if ((packed & 1u << 30) != 0u) {
      vec3 n = virtual_normal(p);
      if (dot(n, n) > 0.5) {
        vec3 on = p - virtual_distance(p) * n;
        vec3 size = vec3(frame.grid.yzw);
        vec3 uvw = (on - grid_low(frame.virtual_grid)) / (size * frame.virtual_grid.w);
        vec3 albedo = textureLod(virtual_color, uvw, 0.0).rgb;
        vec3 e = gather_rho(on, on + 1.5 * frame.virtual_grid.w * n, n, cones, turn);
        imageStore(gathered_virtual, at, to_half(vec4(albedo * e / kPi, 1.0)));
      }
    }
    if ((packed & 1u << 31) != 0u) {
      vec3 n = imageLoad(normal_real, at).xyz;
      if (dot(n, n) > 0.5) {
        n = normalize(n);
        vec3 on = p - real_distance(p) * n, off = on + max(frame.cascade[0].w, 0.5 * frame.field.x) * n;
        vec3 gained, lost;
        gather_delta(on, off, n, cones, turn, gained, lost);
        vec3 e = gained - lost + gather_change(off, on, n, 9, turn);
        imageStore(gathered_real, at, to_half(vec4(imageLoad(albedo_real, at).rgb * e / kPi, 1.0)));
      }
    }
  }
}
