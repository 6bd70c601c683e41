#version 450
// textureLod at given positions: xyz in texture coordinates, w the level.
layout(local_size_x = 8) in;

layout(binding = 1) uniform sampler3D volume;
layout(std430, binding = 2) readonly buffer Places { vec4 places[]; };
layout(std430, binding = 3) writeonly buffer Results { vec4 results[]; };

void main() {
  uint i = gl_GlobalInvocationID.x;
  if (i < uint(places.length())) results[i] = textureLod(volume, places[i].xyz, places[i].w);
}
