#pragma once
// How well supposed lamps explain the shading of a room that no fish-eye sees.
//
// Irradiance of a surface: from known surface its measured radiance, from all other directions an unknown radiance, the
// same everywhere, and the lamps. The albedo of the reference sets the unknown radiance: the tag's white paper, and
// without it, loosely, the median over the room.
#include <Eigen/Core>
#include <span>
#include <vector>

#include "reconstruct/field/distance_field.h"
#include "reconstruct/field/field_rays.h"
#include "reconstruct/field/metal_mask.h"
#include "reconstruct/lamps/sample_pairs.h"
#include "reconstruct/shading/irradiance.h"
#include "reconstruct/shading/surface_samples.h"

namespace lumigraft::reconstruct {

struct SupposedLamp {
  Eigen::Vector3f direction = Eigen::Vector3f::UnitZ();  ///< unit, from the probe
  float distance_m = 1;
  bool flat = false;                              ///< a panel that faces the probe; else isotropic
  Eigen::Array3f power = Eigen::Array3f::Ones();  ///< irradiance at the probe over the unknown radiance
  std::vector<float> factors = {};                ///< irradiance of every sample over that at the probe: `tabulate`
};

class ShadingFit {
 public:
  /// `print_m`: edge of the tag with its paper.
  ShadingFit(const DistanceField& field, const FieldRays& rays, const MetalMask& metal, const Eigen::Vector3f& probe_m,
             double print_m);

  bool empty() const { return samples_.empty(); }  ///< no surface is known
  std::size_t pairs() const { return pairs_.size(); }

  /// Computes the lamp's factors, with `rays` over its disk.
  void tabulate(SupposedLamp& lamp, int rays) const;
  /// Whether a lamp there would have been seen: surface is known in its direction from the probe, or it would have
  /// hidden coloured surface from a camera.
  bool is_excluded(const SupposedLamp& lamp) const;

  /// Robust sum over the pairs (robust_cost), plus wide priors: a lamp is white and at a usual distance.
  double cost(std::span<const SupposedLamp> lamps);
  /// Of the last call of `cost`; per channel.
  const Eigen::Array3f& unknown_radiance() const { return unknown_radiance_; }

 private:
  Eigen::Array3f relative_irradiance(std::size_t sample, std::span<const SupposedLamp> lamps) const;
  void scale(std::span<const SupposedLamp> lamps);

  const DistanceField& field_;
  const FieldRays& rays_;
  Eigen::Vector3f probe_m_;
  IrradianceModel room_;
  std::vector<SurfaceSample> samples_;
  std::vector<SamplePair> pairs_;
  std::vector<std::size_t> reference_;  ///< samples that have, in the median, the albedo
  float reference_albedo_ = 0;
  float noise_floor_ = 0;                     ///< radiance
  std::vector<Eigen::Array3f> log_radiance_;  ///< of the samples
  std::vector<Eigen::Array3f> known_;         ///< irradiance from known surface
  std::vector<Eigen::Array3f> unknown_;       ///< irradiance from unknown directions, for unit radiance
  std::vector<Eigen::Array3f> log_albedo_;    ///< of the last call of `cost`
  Eigen::Array3f unknown_radiance_ = Eigen::Array3f::Zero();
};

}  // namespace lumigraft::reconstruct
