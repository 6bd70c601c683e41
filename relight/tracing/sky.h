#pragma once
// Distant light: a latitude-longitude map, or constant radiance from all directions.
#include <vector>

#include "relight/tracing/lamps.h"

namespace lumigraft::relight {

class Sky {
 public:
  explicit Sky(const ReferenceScene& scene);  ///< keeps a reference

  /// Whether it is worth importance sampling; a constant sky is sampled best by the material.
  bool is_picture() const { return !scene_.environment.radiance.empty() && total_ > 0; }
  Rgb radiance(const Eigen::Vector3f& w) const;
  LightSample sample(const Eigen::Vector2f& u) const;
  float pdf(const Eigen::Vector3f& w) const;  ///< 1/sr; 0 where sample() never samples

 private:
  float weight(int x, int y) const { return weights_[static_cast<std::size_t>(y) * width_ + x]; }
  float texel_sr(int y) const;

  const ReferenceScene& scene_;
  int width_ = 1, height_ = 1;
  std::vector<float> weights_;  ///< of each texel: solid angle times an upper bound of its luminance
  std::vector<double> rows_;    ///< cumulative sums; columns_: within each row
  std::vector<double> columns_;
  double total_ = 0;
};

}  // namespace lumigraft::relight
