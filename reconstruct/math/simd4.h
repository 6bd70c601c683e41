#pragma once
// Vectors of four floats in the compiler's vector types; every supported processor has registers this wide.
#include <cmath>
#include <cstdint>
#ifdef __SSE__
#include <xmmintrin.h>
#endif

namespace lumigraft::reconstruct {

using Simd4 = float __attribute__((vector_size(16)));
using Simd4Int = std::int32_t __attribute__((vector_size(16)));  ///< comparison result per lane: −1 = true, 0 = false

inline Simd4 broadcast(float x) { return Simd4{x, x, x, x}; }
inline Simd4 load(const float* from) {
  Simd4 x;
  __builtin_memcpy(&x, from, sizeof(x));
  return x;
}
inline void store(float* to, Simd4 x) { __builtin_memcpy(to, &x, sizeof(x)); }
inline Simd4 select(Simd4Int where, Simd4 a, Simd4 b) {
  return reinterpret_cast<Simd4>((where & reinterpret_cast<Simd4Int>(a)) | (~where & reinterpret_cast<Simd4Int>(b)));
}
/// If a lane of either operand is NaN, these return that of `b`.
inline Simd4 min(Simd4 a, Simd4 b) { return a < b ? a : b; }
inline Simd4 max(Simd4 a, Simd4 b) { return a > b ? a : b; }
inline Simd4 abs(Simd4 x) {
  return reinterpret_cast<Simd4>(reinterpret_cast<Simd4Int>(x) & Simd4Int{INT32_MAX, INT32_MAX, INT32_MAX, INT32_MAX});
}
/// The compilers have no built-in square root for their vector types.
inline Simd4 sqrt(Simd4 x) {
#ifdef __SSE__
  return _mm_sqrt_ps(x);
#else
  return Simd4{std::sqrt(x[0]), std::sqrt(x[1]), std::sqrt(x[2]), std::sqrt(x[3])};
#endif
}
inline bool any(Simd4Int where) {
  using Halves = std::int64_t __attribute__((vector_size(16)));
  const Halves halves = reinterpret_cast<Halves>(where);
  return (halves[0] | halves[1]) != 0;
}
inline float sum_of(Simd4 x) { return (x[0] + x[1]) + (x[2] + x[3]); }
/// Transposes the 4 × 4 matrix with the rows a, b, c, d.
inline void transpose(Simd4& a, Simd4& b, Simd4& c, Simd4& d) {
  const Simd4 ab_low = __builtin_shufflevector(a, b, 0, 4, 1, 5), ab_high = __builtin_shufflevector(a, b, 2, 6, 3, 7);
  const Simd4 cd_low = __builtin_shufflevector(c, d, 0, 4, 1, 5), cd_high = __builtin_shufflevector(c, d, 2, 6, 3, 7);
  a = __builtin_shufflevector(ab_low, cd_low, 0, 1, 4, 5);
  b = __builtin_shufflevector(ab_low, cd_low, 2, 3, 6, 7);
  c = __builtin_shufflevector(ab_high, cd_high, 0, 1, 4, 5);
  d = __builtin_shufflevector(ab_high, cd_high, 2, 3, 6, 7);
}

}  // namespace lumigraft::reconstruct
