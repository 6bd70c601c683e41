// Light that is not finite counts as none; a channel alone would be a wrong colour.
#ifndef FINITE_GLSL
#define FINITE_GLSL
vec3 finite_or_zero(vec3 x) { return any(isnan(x)) || any(isinf(x)) ? vec3(0) : x; }
#endif
