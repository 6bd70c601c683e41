// Rounds to 16-bit floats explicitly, because stores truncate on some devices; values that are halves already are
// stored exactly.
#ifndef HALF_GLSL
#define HALF_GLSL
// Nearest half, ties away from zero, clamped to the finite range; NaN becomes 0.
float to_half(float x) {
  if (!(abs(x) < 65504.0)) return isnan(x) ? 0.0 : sign(x) * 65504.0;
  if (abs(x) < 6.2e-5) return round(x * 16777216.0) / 16777216.0;  // below the normal range: multiples of 2^-24
  uint bits = floatBitsToUint(x) + 0x1000u;                         // half of the 13 dropped bits
  return clamp(uintBitsToFloat(bits & 0xffffe000u), -65504.0, 65504.0);
}
vec4 to_half(vec4 v) { return vec4(to_half(v.x), to_half(v.y), to_half(v.z), to_half(v.w)); }
#endif
