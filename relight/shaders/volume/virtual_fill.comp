#version 460
#extension GL_GOOGLE_include_directive : require
// Transforms a virtual object's distance field into the volume of all objects: the smallest distance is kept. pass_i.x:
// 1 for the first object. pass_f.rgb: reflectance of an object of one material, a: 1 when it applies. object:
// T_model_tag in the first three rows, then the field's grid.
#include "common/frame.glsl"
#include "common/half.glsl"
layout(local_size_x = 8, local_size_y = 4, local_size_z = 2) in;
layout(binding = 1) uniform sampler3D object_distance;  // in model metres
layout(binding = 2) uniform sampler3D object_reflectance;
layout(binding = 3, r16f) uniform image3D volume_distance;
layout(binding = 4, rgba8) uniform image3D volume_reflectance;
layout(std430, binding = 5) readonly buffer Placed { vec4 placed[]; };  // rows of T_model_tag; origin, voxel; scale

void main() {
  ivec3 at = ivec3(gl_GlobalInvocationID);
  if (any(greaterThanEqual(at, frame.grid.yzw))) return;
  vec4 p = vec4(frame.virtual_grid.xyz + frame.virtual_grid.w * vec3(at), 1.0);
  vec3 m = vec3(dot(placed[0], p), dot(placed[1], p), dot(placed[2], p));
  float scale = placed[4].x;

  vec3 size = vec3(textureSize(object_distance, 0));
  vec3 g = (m - placed[3].xyz) / placed[3].w;  // in voxels of the object's field
  vec3 inside = clamp(g, vec3(0), size - 1.0);
  float beyond = length(g - inside) * placed[3].w;
  vec3 uvw = (inside + 0.5) / size;
  float d = textureLod(object_distance, uvw, 0.0).r;
  d = (beyond > 0.0 ? sqrt(beyond * beyond + d * d) : d) * scale;

  float before = frame.pass_i.x == 1 ? 1e4 : imageLoad(volume_distance, at).r;
  if (d < before) {
    vec3 reflectance = frame.pass_f.a > 0.0 ? frame.pass_f.rgb : textureLod(object_reflectance, uvw, 0.0).rgb;
    imageStore(volume_distance, at, vec4(to_half(d)));
    imageStore(volume_reflectance, at, vec4(reflectance, 1.0));
  }
}
