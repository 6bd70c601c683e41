#version 460
#extension GL_GOOGLE_include_directive : require
// One more bounce (thesis eq. 3.13): real surfaces in the listed voxels gather the change from the volumes as they are,
// where the objects fill more than pass_f.x of the hemisphere.
#include "gather.glsl"
#include "voxel_list.glsl"
#include "half.glsl"
layout(local_size_x = 64) in;
layout(binding = 18, rgba16f) uniform writeonly image3D gathered;
layout(binding = 25, rgba16f) uniform readonly image3D albedo_real;
layout(binding = 26, rgba16f) uniform readonly image3D normal_real;

void main() {
  for (uint i = gl_GlobalInvocationID.x; i < voxels_listed(); i += gl_NumWorkGroups.x * 64u) {
    Voxel voxel = listed_voxel(i);
    vec3 p = voxel.position, to = frame.sphere.xyz - p, n = imageLoad(normal_real, voxel.at).xyz;
    bool near = frame.sphere.w * frame.sphere.w > frame.pass_f.x * dot(to, to);
    vec4 albedo = imageLoad(albedo_real, voxel.at);
    if (!voxel.is_real || !near || albedo.a == 0.0 || dot(n, n) < 0.5) continue;
    n = normalize(n);
    vec3 on = p - real_distance(p) * n, off = on + max(frame.cascade[0].w, 0.75 * frame.field.x) * n;
    vec3 gained, lost;
    gather_delta(on, off, n, frame.counts.y, voxel_turn(voxel), gained, lost);
    vec3 e = gained - lost + gather_change(off, on, n, 9, voxel_turn(voxel));
    imageStore(gathered, voxel.at, to_half(vec4(albedo.rgb * e / kPi, 1.0)));
  }
}
