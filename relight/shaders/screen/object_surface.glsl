// Writes material and normal of a surface that is drawn into the camera view.
#include "common/surface_material.glsl"
layout(location = 0) in vec3 world;
layout(location = 1) in vec3 world_normal;
layout(location = 2) in vec4 uv;
layout(location = 3) in vec3 tint;
layout(location = 4) in float depth_m;
layout(location = 7) in vec4 world_tangent;
layout(location = 0) out vec4 out_normal;  // roughness in a
layout(location = 1) out vec4 out_base;    // metallic in a; + 2: glTF; + 4 · (number of its Glass + 1)
layout(location = 2) out vec2 out_depth;   // metres along z; specular + 2 · object's number, 0: nothing

// Returns whether the camera sees the front.
bool write_surface() {
  float l = length(world_normal);
  vec3 n = l > 1e-9 ? world_normal / l : vec3(0, 0, 1);
  vec3 eye = -(transpose(mat3(draw.T_view_tag)) * draw.T_view_tag[3].xyz);
  vec3 shading = surface_normal(n, world, uv, world_tangent);
  bool front = dot(n, eye - world) >= 0.0 || gl_FrontFacing;
  if (!front) {
    n = -n;
    shading = -shading;
  }
  if (dot(shading, eye - world) <= 0.0) shading = n;
  vec2 roughness_metallic = surface_roughness_metallic(uv);
  out_normal = vec4(shading, roughness_metallic.x);
  vec3 color = is_unlit() ? vec3(0) : surface_color(uv, tint);  // what is unlit shows no reflected light
  out_base = vec4(color, roughness_metallic.y + 2.0 * draw.maps.w + 4.0 * draw.tint.y);
  out_depth = vec2(depth_m, draw.material.z + 2.0 * draw.material.w);
  return front;
}
