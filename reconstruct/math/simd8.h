#pragma once
// Eight floats at a time, a row of a brick, in the compiler's own vectors. A processor without vectors as wide takes
// two steps for each; a function that is compiled for wider ones (gnu::target) and calls these takes one. None of these
// is ever called, all are inlined: what includes this is compiled with -Wno-psabi.
#include <cstdint>
#ifdef __SSE__
#include <xmmintrin.h>
#endif

#include "reconstruct/math/simd4.h"

namespace lumigraft::reconstruct {

using Simd8 = float __attribute__((vector_size(32)));
using Simd8Int = std::int32_t __attribute__((vector_size(32)));  ///< of a comparison: −1 where it holds, else 0

[[gnu::always_inline]] inline Simd8 all_eight(float x) { return x - Simd8{}; }
[[gnu::always_inline]] inline Simd8 load_eight(const float* from) {
  Simd8 x;
  __builtin_memcpy(&x, from, sizeof(x));
  return x;
}
[[gnu::always_inline]] inline void store(float* to, Simd8 x) { __builtin_memcpy(to, &x, sizeof(x)); }
[[gnu::always_inline]] inline Simd8 select(Simd8Int where, Simd8 a, Simd8 b) {
  return reinterpret_cast<Simd8>((where & reinterpret_cast<Simd8Int>(a)) | (~where & reinterpret_cast<Simd8Int>(b)));
}
/// Where one is no number these give the second.
[[gnu::always_inline]] inline Simd8 min(Simd8 a, Simd8 b) { return a < b ? a : b; }
[[gnu::always_inline]] inline Simd8 max(Simd8 a, Simd8 b) { return a > b ? a : b; }
[[gnu::always_inline]] inline Simd8 size_of(Simd8 x) {
  return reinterpret_cast<Simd8>(reinterpret_cast<Simd8Int>(x) & (INT32_MAX - Simd8Int{}));
}
[[gnu::always_inline]] inline Simd4 low_of(Simd8 x) { return __builtin_shufflevector(x, x, 0, 1, 2, 3); }
[[gnu::always_inline]] inline Simd4 high_of(Simd8 x) { return __builtin_shufflevector(x, x, 4, 5, 6, 7); }
[[gnu::always_inline]] inline Simd8 joined(Simd4 low, Simd4 high) {
  return __builtin_shufflevector(low, high, 0, 1, 2, 3, 4, 5, 6, 7);
}
[[gnu::always_inline]] inline Simd8 sqrt(Simd8 x) { return joined(sqrt(low_of(x)), sqrt(high_of(x))); }
/// A bit for each lane where it holds, the first lane's the lowest.
[[gnu::always_inline]] inline unsigned bits_of(Simd8Int where) {
#ifdef __SSE__
  const Simd8 lanes = reinterpret_cast<Simd8>(where);
  return static_cast<unsigned>(_mm_movemask_ps(low_of(lanes)) | (_mm_movemask_ps(high_of(lanes)) << 4));
#else
  unsigned bits = 0;
  for (unsigned k = 0; k < 8; ++k) bits |= where[k] ? 1u << k : 0u;
  return bits;
#endif
}
[[gnu::always_inline]] inline bool any(Simd8Int where) { return bits_of(where) != 0; }

/// Before a function that is to take one step for each; only where `has_eight` it may be called.
#if defined(__x86_64__)
#define LUMIGRAFT_EIGHT_WIDE [[gnu::target("avx2")]]
inline bool has_eight() { return __builtin_cpu_supports("avx2"); }
#else
#define LUMIGRAFT_EIGHT_WIDE
inline bool has_eight() { return false; }
#endif

}  // namespace lumigraft::reconstruct
