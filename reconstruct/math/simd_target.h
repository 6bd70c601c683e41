#pragma once
// Functions compiled for AVX2 in addition to the baseline instruction set. Inlined code is compiled for both; products
// and sums are not contracted to fused operations, so both give the same result.

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
