#pragma once
// Spectrum of noise in three channels, with the correlation between them, and noise that has it.
#include <Eigen/Core>
#include <array>
#include <complex>
#include <memory>
#include <vector>

#include "relight/look/noise_model.h"

namespace lumigraft::relight {

/// Mean of periodograms (Welch 1967) of patches with a Hann window.
class NoiseSpectrum {
 public:
  static constexpr int kEdge = 16;  ///< of a patch, pixels
  using Patch = std::array<float, std::size_t{kEdge} * kEdge>;

  /// `patch`: by channel, with mean 0. Each channel counts relative to its own variance.
  void add(const std::array<Patch, 3>& patch);
  void decay(float factor) {
    weight_ *= factor;
    for (auto& s : sum_) s *= factor;
  }
  bool empty() const { return weight_ == 0; }

  /// Patches have mean 0, so low frequencies are missing in them; the spectrum continues its neighbours there. This is
  /// the variance with them over that without, by channel.
  Eigen::Array3f missing_variance() const;
  /// Random values from a fixed seed.
  std::shared_ptr<const NoiseTile> tile() const;

 private:
  using Density = Eigen::Matrix3cf;  ///< between channels; Hermitian
  static constexpr std::size_t kBins = std::size_t{kEdge} * kEdge;
  std::vector<Density> complete() const;

  float weight_ = 0;
  std::vector<Density> sum_ = std::vector<Density>(kBins, Density::Zero());
};

}  // namespace lumigraft::relight
