#version 450
layout(binding = 1) uniform sampler2D weight;
layout(location = 0) in vec3 shade;
layout(location = 0) out vec4 color;
layout(location = 1) out float facing;

void main() {
  color = vec4(shade * texelFetch(weight, ivec2(0), 0).r, 1);
  facing = float((gl_FrontFacing ? 1u : 2u) | (uint(gl_FragCoord.y) << 8));
}
