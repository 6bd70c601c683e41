// Groups of 64 threads iterate over a slice of a list: pass_i.z is the slice's number, pass_i.w the number of slices.
#ifndef SLICE_GLSL
#define SLICE_GLSL
#include "common/frame.glsl"
layout(local_size_x = 64) in;
uint slice_first() {
  return (uint(frame.pass_i.z) * gl_NumWorkGroups.x + gl_WorkGroupID.x) * 64u + gl_LocalInvocationID.x;
}
uint slice_stride() { return uint(frame.pass_i.w) * gl_NumWorkGroups.x * 64u; }
#endif
