#pragma once
// Vectors of eight floats (a row of a brick) in the compiler's vector types. Baseline code uses two registers of four;
// a function compiled for AVX2 (LUMIGRAFT_SIMD8_TARGET) that inlines these uses one of eight. All functions here are
// always inlined, so no vector is passed by a call: files that include this are compiled with -Wno-psabi.
#include <cstdint>
#ifdef __SSE__
#include <xmmintrin.h>
#endif

#include "reconstruct/math/simd4.h"
#include "reconstruct/math/simd_target.h"

namespace lumigraft::reconstruct {

using Simd8 = float __attribute__((vector_size(32)));
using Simd8Int = std::int32_t __attribute__((vector_size(32)));  ///< comparison result per lane: −1 = true, 0 = false

[[gnu::always_inline]] inline Simd8 broadcast8(float x) { return x - Simd8{}; }
[[gnu::always_inline]] inline Simd8 load8(const float* from) {
  Simd8 x;
  __builtin_memcpy(&x, from, sizeof(x));
  return x;
}
[[gnu::always_inline]] inline void store(float* to, Simd8 x) { __builtin_memcpy(to, &x, sizeof(x)); }
[[gnu::always_inline]] inline Simd8 select(Simd8Int where, Simd8 a, Simd8 b) { return where ? a : b; }
/// If a lane of either operand is NaN, these return that of `b`.
[[gnu::always_inline]] inline Simd8 min(Simd8 a, Simd8 b) { return a < b ? a : b; }
[[gnu::always_inline]] inline Simd8 max(Simd8 a, Simd8 b) { return a > b ? a : b; }
[[gnu::always_inline]] inline Simd8 abs(Simd8 x) {
  return reinterpret_cast<Simd8>(reinterpret_cast<Simd8Int>(x) & (INT32_MAX - Simd8Int{}));
}
[[gnu::always_inline]] inline Simd4 low_half(Simd8 x) { return __builtin_shufflevector(x, x, 0, 1, 2, 3); }
[[gnu::always_inline]] inline Simd4 high_half(Simd8 x) { return __builtin_shufflevector(x, x, 4, 5, 6, 7); }
[[gnu::always_inline]] inline Simd8 join(Simd4 low, Simd4 high) {
  return __builtin_shufflevector(low, high, 0, 1, 2, 3, 4, 5, 6, 7);
}
[[gnu::always_inline]] inline Simd8 sqrt(Simd8 x) { return join(sqrt(low_half(x)), sqrt(high_half(x))); }
/// One bit per lane that is true; lane 0 is the lowest bit.
[[gnu::always_inline]] inline unsigned lane_mask(Simd8Int where) {
#ifdef __SSE__
  const Simd8 lanes = reinterpret_cast<Simd8>(where);
  return static_cast<unsigned>(_mm_movemask_ps(low_half(lanes)) | (_mm_movemask_ps(high_half(lanes)) << 4));
#else
  unsigned bits = 0;
  for (unsigned k = 0; k < 8; ++k) bits |= where[k] ? 1u << k : 0u;
  return bits;
#endif
}
[[gnu::always_inline]] inline bool any(Simd8Int where) { return lane_mask(where) != 0; }

}  // namespace lumigraft::reconstruct
