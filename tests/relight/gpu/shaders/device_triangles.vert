#version 450
layout(std140, binding = 0) uniform Params { vec4 tint; } params;
layout(location = 0) in vec4 position;
layout(location = 1) in vec3 color;
layout(location = 0) out vec3 shade;

void main() {
  gl_Position = position;
  shade = color * params.tint.rgb;
}
