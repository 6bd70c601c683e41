#pragma once
// Light from far away: a latitude-longitude picture, or the same from everywhere.
#include <vector>

#include "relight/tracing/lamps.h"

namespace lumigraft::relight {

class Sky {
 public:
  explicit Sky(const ReferenceScene& scene);  ///< keeps a reference

  /// Worth samples of its own. An even sky is found best by following the material.
  bool is_picture() const { return !scene_.environment.radiance.empty() && total_ > 0; }
  Rgb radiance(const Eigen::Vector3f& w) const;
  LightSample sample(const Eigen::Vector2f& u) const;
  float pdf(const Eigen::Vector3f& w) const;  ///< 1/sr; 0 where there are no samples

 private:
  float weight(int x, int y) const { return weights_[static_cast<std::size_t>(y) * width_ + x]; }
  float texel_sr(int y) const;

  const ReferenceScene& scene_;
  int width_ = 1, height_ = 1;
  std::vector<float> weights_;  ///< of a texel's solid angle times the luminance it can have
  std::vector<double> rows_;    ///< running sums; columns_ those within each row
  std::vector<double> columns_;
  double total_ = 0;
};

}  // namespace lumigraft::relight
