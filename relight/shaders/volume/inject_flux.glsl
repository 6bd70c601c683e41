// Reflected or emitted flux, split over voxels.
#ifndef INJECT_FLUX_GLSL
#define INJECT_FLUX_GLSL
#include "volume/splat.glsl"

ivec3 fixed_point(vec3 flux) { return ivec3(round(flux * frame.field.z)); }

#define INJECT(name, kind, target)                                                  \
  void name(vec3 p, vec3 ahead, vec3 flux) {                                       \
    for (int c = 0; c < kCascades; ++c) {                                          \
      Splat s = splat_at(c, p, ahead);                                             \
      if (!s.inside) continue;                                                     \
      ivec3 left = fixed_point(flux);                                              \
      for (int i = 0; i < 8; ++i) { /* the last takes what rounding left over */   \
        ivec3 part = i == 7 ? left : fixed_point(flux * splat_weight(s, i));       \
        left -= part;                                                              \
        uint at = splat_voxel(kind, s, i);                                         \
        if (!is_kept(at)) continue;                                                \
        atomicAdd(target[3u * at], part.x);                                        \
        atomicAdd(target[3u * at + 1u], part.y);                                   \
        atomicAdd(target[3u * at + 2u], part.z);                                   \
      }                                                                            \
    }                                                                              \
  }
#endif
