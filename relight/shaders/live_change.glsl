// The factor by which direct and indirect light change what a pixel shows of the real room.
#ifndef LIVE_CHANGE_GLSL
#define LIVE_CHANGE_GLSL
#include "live_real.glsl"
#include "lamp_shadow.glsl"
#include "srgb.glsl"

vec3 live_gain(LiveReal r) { return bounded_gain(1.0 + r.response * (r.indirect - lamps_lost(r.p, r.n, r.slack))); }
#endif
