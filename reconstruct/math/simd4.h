#pragma once
// Four floats at a time, in the compiler's own vectors: every processor has them this wide.
#include <cmath>
#include <cstdint>
#ifdef __SSE__
#include <xmmintrin.h>
#endif

namespace lumigraft {

using Four = float __attribute__((vector_size(16)));
using FourInt = std::int32_t __attribute__((vector_size(16)));  ///< of a comparison: −1 where it holds, else 0

inline Four all(float x) { return Four{x, x, x, x}; }
inline Four load(const float* from) {
  Four x;
  __builtin_memcpy(&x, from, sizeof(x));
  return x;
}
inline void store(float* to, Four x) { __builtin_memcpy(to, &x, sizeof(x)); }
inline Four select(FourInt where, Four a, Four b) {
  return reinterpret_cast<Four>((where & reinterpret_cast<FourInt>(a)) | (~where & reinterpret_cast<FourInt>(b)));
}
/// Where one is no number these give the second.
inline Four least(Four a, Four b) { return a < b ? a : b; }
inline Four most(Four a, Four b) { return a > b ? a : b; }
inline Four size_of(Four x) {
  return reinterpret_cast<Four>(reinterpret_cast<FourInt>(x) & FourInt{INT32_MAX, INT32_MAX, INT32_MAX, INT32_MAX});
}
/// Every processor has one, but the compilers have no vector of them.
inline Four root(Four x) {
#ifdef __SSE__
  return _mm_sqrt_ps(x);
#else
  return Four{std::sqrt(x[0]), std::sqrt(x[1]), std::sqrt(x[2]), std::sqrt(x[3])};
#endif
}
inline bool any(FourInt where) {
  using Halves = std::int64_t __attribute__((vector_size(16)));
  const Halves halves = reinterpret_cast<Halves>(where);
  return (halves[0] | halves[1]) != 0;
}
inline float sum_of(Four x) { return (x[0] + x[1]) + (x[2] + x[3]); }
/// Rows to columns.
inline void transpose(Four& a, Four& b, Four& c, Four& d) {
  const Four ab_low = __builtin_shufflevector(a, b, 0, 4, 1, 5), ab_high = __builtin_shufflevector(a, b, 2, 6, 3, 7);
  const Four cd_low = __builtin_shufflevector(c, d, 0, 4, 1, 5), cd_high = __builtin_shufflevector(c, d, 2, 6, 3, 7);
  a = __builtin_shufflevector(ab_low, cd_low, 0, 1, 4, 5);
  b = __builtin_shufflevector(ab_low, cd_low, 2, 3, 6, 7);
  c = __builtin_shufflevector(ab_high, cd_high, 0, 1, 4, 5);
  d = __builtin_shufflevector(ab_high, cd_high, 2, 3, 6, 7);
}

}  // namespace lumigraft
