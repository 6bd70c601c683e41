#version 460
#extension GL_GOOGLE_include_directive : require
// Flux that an object's surface emits, into the voxels in front of it (see area.comp). pass_m: T_tag_model; pass_f.rgb:
// factor from the samples' emission to W/sr/m², or that radiance itself if pass_i.y is 1; pass_f.a: from m² in the
// model's frame to m²; pass_i.x: number of samples.
#include "volume/volume.glsl"
#include "volume/inject_flux.glsl"
layout(local_size_x = 64) in;
layout(std430, binding = 16) buffer VirtualFlux { int virtual_flux[]; };  // chunk, voxel, channel
layout(std430, binding = 17) readonly buffer Samples { vec4 samples[]; };  // position, area; normal; emission
INJECT(inject_virtual, kVirtual, virtual_flux)

void main() {
  for (uint i = gl_GlobalInvocationID.x; i < uint(frame.pass_i.x); i += gl_NumWorkGroups.x * 64u) {
    vec3 p = (frame.pass_m * vec4(samples[3u * i].xyz, 1.0)).xyz;
    vec3 n = normalize(mat3(frame.pass_m) * samples[3u * i + 1u].xyz);
    if (virtual_distance(p + 0.75 * frame.virtual_grid.w * n) <= 0.0) continue;  // inside another object
    vec3 radiance = frame.pass_f.rgb * (frame.pass_i.y == 1 ? vec3(1) : samples[3u * i + 2u].rgb);
    inject_virtual(p, kFront * n, kPi * samples[3u * i].w * frame.pass_f.a * radiance);
  }
}
