#version 460
#extension GL_GOOGLE_include_directive : require
#include "common/bsdf_params.glsl"
#include "common/clearcoat.glsl"
#include "common/surface_material.glsl"
layout(location = 0) in vec3 world;
layout(location = 1) in vec4 uv;
layout(location = 2) in vec3 tint;
layout(location = 3) in vec3 world_normal;
layout(location = 0) out vec4 out_position;  // a: 1 where there is an object
layout(location = 1) out vec4 out_albedo;
layout(location = 2) out vec4 out_normal;

void main() {
  vec3 n = normalize(world_normal + vec3(0, 0, 1e-9));
  vec3 lamp = -(transpose(mat3(draw.T_view_tag)) * draw.T_view_tag[3].xyz);
  vec2 roughness_metallic = surface_roughness_metallic(uv);
  BsdfParams bsdf = bsdf_of(surface_color(uv, tint), roughness_metallic.x, roughness_metallic.y, draw.material.z);
  bsdf.gltf = draw.maps.w > 0.0;
  bsdf.diffuse *= 1.0 - surface_transmission(uv);  // the rest passes
  out_position = vec4(world, 1.0);
  out_normal = vec4(n, 0.0);
  // Specular reflection is stored as diffuse: metals keep their colour in the volumes.
  float cosine = abs(dot(n, normalize(lamp - world))), share = coat_share(surface_coat(uv).x, cosine);
  out_albedo = vec4(mix(reflectance(bsdf, cosine), vec3(1), share), 1.0);
}
