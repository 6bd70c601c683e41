#version 450
// Copies std140 parameters, one of each alignment, to a storage buffer.
layout(local_size_x = 8) in;

layout(std140, binding = 0) uniform Params {
  mat4 matrix;
  vec3 position;
  float scale;
  ivec4 counts;
  vec4 colors[2];
  uint seed;
} params;

layout(std430, binding = 1) buffer Result { float values[]; } result;

void main() {
  uint i = gl_GlobalInvocationID.x;
  float value = 0.0;
  if (i < 16u) value = params.matrix[i / 4u][i % 4u];
  else if (i < 19u) value = params.position[i - 16u];
  else if (i == 19u) value = params.scale;
  else if (i < 24u) value = float(params.counts[i - 20u]);
  else if (i < 32u) value = params.colors[(i - 24u) / 4u][i % 4u];
  else if (i == 32u) value = float(params.seed);
  if (i < 40u) result.values[i] = value;
}
