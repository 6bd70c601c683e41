#pragma once
// Light on every surface point, and from it and the samples' albedo the point's own.
#include <Eigen/Core>
#include <vector>

#include "reconstruct/albedo/albedo_bricks.h"
#include "reconstruct/albedo/sample_solver.h"
#include "reconstruct/shading/irradiance.h"
#include "reconstruct/shading/surface_samples.h"

namespace lumigraft::reconstruct {

class LitSurface {
 public:
  static constexpr float kNeighbourReach = 2.5f;  ///< in sample cells

  /// `gathered` is IrradianceModel::gather of each sample; points take it from the samples around them. Visibility is
  /// cast for samples, and for points where samples next to each other differ. `dark` is dark_radiance of the room's
  /// samples. `held`: albedo of the last samples, where that is known already.
  LitSurface(const Surface& surface, const IrradianceModel& room, const Illumination& illumination,
             const std::vector<Eigen::Vector3f>& gathered, float dark, const std::vector<SampleAlbedo>& held = {});

  const std::vector<SampleLight>& sample_light() const { return sample_light_; }
  const std::vector<std::vector<int>>& neighbours() const { return neighbours_; }

  /// Each point's own π B / E, and the samples' albedo around it, by their uncertainties.
  std::vector<PointAlbedo> albedo(const std::vector<SampleAlbedo>& samples) const;

 private:
  Eigen::Vector3f lamp_irradiance(std::size_t lamp, const Eigen::Vector3f& position, const Eigen::Vector3f& normal,
                                  float visible) const;
  /// Visibility of a lamp at a point: the samples' around it where they agree.
  float visibility(std::size_t lamp, const SurfacePoint& point) const;

  const Surface& surface_;
  const IrradianceModel& room_;
  const Illumination& illumination_;
  const std::vector<Eigen::Vector3f>& gathered_;
  float dark_;
  std::vector<std::vector<int>> neighbours_;
  std::vector<std::vector<float>> visible_;  ///< per lamp, per sample
  std::vector<std::vector<float>> left_;     ///< of that, per lamp, per sample: what nobody saw leaves (hidden_shadows)
  std::vector<std::vector<float>> contrast_;  ///< per lamp, per sample: how much visibility varies around it
  std::vector<SampleLight> sample_light_;
};

}  // namespace lumigraft::reconstruct
