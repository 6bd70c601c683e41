#pragma once
// Functions for processors with wide registers, beside those for all processors. Inlined code is compiled for both; no
// products and sums are fused, so both compute the same.

namespace lumigraft::reconstruct {

/// Attribute of a function that uses AVX2; call it only if simd8_supported().
#if defined(__x86_64__)
#define LUMIGRAFT_SIMD8_TARGET [[gnu::target("avx2")]]
inline bool simd8_supported() { return __builtin_cpu_supports("avx2"); }
#else
#define LUMIGRAFT_SIMD8_TARGET
inline bool simd8_supported() { return false; }
#endif

}  // namespace lumigraft::reconstruct
