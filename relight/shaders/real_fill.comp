#version 460
#extension GL_GOOGLE_include_directive : require
// The fused field resampled into one cascade: distance, measured radiance L_mu (which holds every bounce of the real
// room), albedo. pass_i.x: the cascade.
#include "bricks.glsl"
#include "half.glsl"
layout(local_size_x = 8, local_size_y = 4, local_size_z = 2) in;
layout(binding = 1, r16f) uniform writeonly image3D out_distance;
layout(binding = 2, rgba16f) uniform writeonly image3D out_radiance;  // rgb times weight, weight
layout(binding = 3, rgba16f) uniform writeonly image3D out_albedo;    // rgb, known
layout(binding = 4, rgba16f) uniform writeonly image3D out_normal;

void main() {
  ivec3 at = ivec3(gl_GlobalInvocationID);
  if (any(greaterThanEqual(at, ivec3(frame.grid.x)))) return;
  vec4 cascade = frame.cascade[frame.pass_i.x];
  vec3 p = cascade.xyz + cascade.w * vec3(at);
  float truncation = frame.field.y;

  float d, far = max(field_clearance(p), truncation);
  bool known = field_distance(p, d);
  vec4 radiance = vec4(0), albedo = vec4(0);
  vec3 n = vec3(0);
  if (!known) {
    d = far;
  } else {
    if (abs(d) < min(2.0 * cascade.w, 0.9 * truncation)) {
      vec3 g;
      if (field_gradient(p, d, g)) {
        float slope = length(g);
        n = g / slope;
        d /= clamp(slope, 0.25, 1.25);  // fused distances run along rays of view; near the surface this undoes it
        float weight = max(0.0, 1.0 - abs(d) / cascade.w);
        if (weight > 0.0) {
          vec3 on = p - d * n;
          radiance = field_radiance(on);
          if (radiance.a == 0.0) radiance = field_radiance(p);
          albedo = field_albedo(on);
          if (albedo.a == 0.0) albedo = field_albedo(p);
          weight = radiance.a > 0.0 ? weight : 0.0;
          radiance = vec4(radiance.rgb * weight, weight);
          albedo.a = albedo.a > 0.0 ? 1.0 : 0.0;
        }
      }
    }
    if (d > 0.95 * truncation) d = far;
  }
  imageStore(out_distance, at, vec4(to_half(d)));
  imageStore(out_radiance, at, to_half(radiance));
  imageStore(out_albedo, at, to_half(albedo));
  imageStore(out_normal, at, to_half(vec4(n, 0.0)));
}
