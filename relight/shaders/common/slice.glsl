// Groups of 64 threads walk a slice of a list together: pass_i.z is its number, pass_i.w how many there are.
#ifndef SLICE_GLSL
#define SLICE_GLSL
#include "common/frame.glsl"
uint slice_first() {
  return (uint(frame.pass_i.z) * gl_NumWorkGroups.x + gl_WorkGroupID.x) * 64u + gl_LocalInvocationID.x;
}
uint slice_stride() { return uint(frame.pass_i.w) * gl_NumWorkGroups.x * 64u; }
#endif
