#version 460
layout(location = 0) in vec3 in_map;

void main() {
  if (any(greaterThan(abs(in_map.xy), in_map.zz))) discard;
}
