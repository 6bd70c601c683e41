#pragma once
// Deterministic sample values: a function of pixel, sample and dimension only, so equal on every run and thread.
//
// Each pair of dimensions is a two-dimensional Sobol' sequence over the samples, scrambled and shuffled by hashes of
// pixel and dimension (Owen 1995; Burley 2020, "Practical Hash-based Owen Scrambling"): every value is uniform in [0,
// 1), and a pixel's samples are stratified in each pair.
#include <Eigen/Core>
#include <cstdint>

namespace lumigraft::relight {

class Sampler {
 public:
  Sampler(std::uint32_t seed, std::uint32_t pixel, std::uint32_t sample)
      : key_(hashed((std::uint64_t{seed} << 32) | pixel)), sample_(sample) {}

  Eigen::Vector2f two() {
    const std::uint64_t pair = hashed(key_ + ++draw_);
    const std::uint32_t index = reversed(scrambled(reversed(sample_), static_cast<std::uint32_t>(pair)));
    const std::uint64_t digits = hashed(pair);
    return {unit(reversed(scrambled(index, static_cast<std::uint32_t>(digits)))),
            unit(reversed(scrambled(second_dimension(index), static_cast<std::uint32_t>(digits >> 32))))};
  }
  float one() { return two().x(); }

 private:
  static float unit(std::uint32_t x) { return static_cast<float>(x >> 8) * 0x1p-24f; }

  /// Steele, Lea & Flood 2014, "Fast Splittable Pseudorandom Number Generators".
  static std::uint64_t hashed(std::uint64_t x) {
    x += 0x9e3779b97f4a7c15u;
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
    return x ^ (x >> 31);
  }

  static std::uint32_t reversed(std::uint32_t x) {
    x = __builtin_bswap32(x);
    x = ((x & 0x0f0f0f0fu) << 4) | ((x & 0xf0f0f0f0u) >> 4);
    x = ((x & 0x33333333u) << 2) | ((x & 0xccccccccu) >> 2);
    return ((x & 0x55555555u) << 1) | ((x & 0xaaaaaaaau) >> 1);
  }

  /// Owen scrambling of a value with reversed bits: flips each bit depending on those below it (Laine & Karras 2011).
  static std::uint32_t scrambled(std::uint32_t x, std::uint32_t seed) {
    x += seed;
    x ^= x * 0x6c50b47cu;
    x ^= x * 0xb82f1e52u;
    x ^= x * 0xc7afe638u;
    x ^= x * 0x8d22f6e6u;
    return x;
  }

  /// The second dimension of Sobol's sequence, with reversed bits. Its direction numbers are the rows of Pascal's
  /// triangle modulo 2, of which C(k, i) is odd where the bits of i are bits of k (Lucas): bit i of the result is the
  /// parity of all such bits k of the index.
  static std::uint32_t second_dimension(std::uint32_t index) {
    index ^= (index >> 1) & 0x55555555u;
    index ^= (index >> 2) & 0x33333333u;
    index ^= (index >> 4) & 0x0f0f0f0fu;
    index ^= (index >> 8) & 0x00ff00ffu;
    return index ^ ((index >> 16) & 0x0000ffffu);
  }

  std::uint64_t key_;
  std::uint32_t sample_;
  std::uint64_t draw_ = 0;
};

}  // namespace lumigraft::relight
