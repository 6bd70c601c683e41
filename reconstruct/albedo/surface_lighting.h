#pragma once
// Irradiance of samples and surface points, and the albedo of points.
#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "reconstruct/albedo/albedo_bricks.h"
#include "reconstruct/albedo/sample_solver.h"
#include "reconstruct/albedo/shadow_carving.h"
#include "reconstruct/albedo/unobserved_occluders.h"
#include "reconstruct/shading/irradiance.h"
#include "reconstruct/shading/surface_samples.h"

namespace lumigraft::reconstruct {

/// A sample close to one of the last solution takes its gathered light; a fraction of them is gathered anew in turn, so
/// that slow changes of the room are followed. All are gathered anew when the light changed or much more of the room is
/// known.
class GatherCache {
 public:
  std::vector<IrradianceModel::Gathered> gather(const IrradianceModel& room, const Illumination& illumination,
                                                const std::vector<SurfaceSample>& samples, std::size_t surface_points,
                                                int rays);
  void forget() { entries_.clear(); }

 private:
  struct Entry {
    Eigen::Vector3f position, normal;
    IrradianceModel::Gathered light;
    std::uint32_t turn = 0;  ///< gathered anew when solves_ equals it, modulo the refresh period
  };
  std::vector<Entry> entries_;
  std::uint32_t solves_ = 0, turns_ = 0;
  Illumination light_;  ///< when all were last gathered
  std::size_t points_ = 0;
};

/// All gathered light of a sample, with the lamps' from the unseen floor (IrradianceModel::lamp_irradiance_on_floor);
/// the sample gets its floor_light and surface_light.
Eigen::Vector3f gathered_light(const IrradianceModel& room, const IrradianceModel::Gathered& gathered,
                               const std::vector<Eigen::Vector3f>& floor_grid, SurfaceSample& sample);

/// Relative 1σ of a sample's modelled irradiance, from the misfit of pairs of samples (LampPosterior::misfit). Half of
/// its square is the variance of one sample. What texture and noise explain is known of each sample and not the
/// model's; the rest is of far pairs, as neighbours share the model's error.
float model_error(const std::vector<SurfaceSample>& samples, float noise_floor, double misfit);

class SurfaceLighting {
 public:
  /// `gathered`: IrradianceModel::gather of each sample; points interpolate it. Rays to lamps are cast for samples, and
  /// for points between samples of different visibility where that changes their light. `noise_floor`:
  /// noise_floor_radiance of the room's samples. `model_error`: as the function's. `held`: known albedo of the last
  /// samples.
  SurfaceLighting(const Surface& surface, const IrradianceModel& room, const Illumination& illumination,
                  const std::vector<Eigen::Vector3f>& gathered, float noise_floor, float model_error,
                  const std::vector<SampleAlbedo>& held = {});

  const std::vector<SampleLight>& sample_light() const { return sample_light_; }
  const std::vector<std::vector<int>>& neighbours() const { return neighbours_; }

  /// Of each lamp, as far as it is certain.
  std::vector<ObservedShadow> shadows() const;

  /// Combines each point's own π B / E with the albedo of the samples around it, by their variances.
  std::vector<PointAlbedo> albedo(const std::vector<SampleAlbedo>& samples) const;

 private:
  /// Weighted means over the sample of a point and its neighbours.
  struct Interpolated {
    Eigen::Vector3f gathered;
    Eigen::ArrayXf visible;  ///< of each lamp
    bool known = false;      ///< albedo of at least one sample is known; else the rest is not set
    Eigen::Vector3f albedo;
    float sigma = 0;                                      ///< absolute,
    float own_sigma = 0;                                  ///< without errors of modelled light,
    Eigen::Array3f known_ratio = Eigen::Array3f::Zero();  ///< log of it over π B / E, where earlier light changed it
    float texture = 0;                                    ///< relative 1σ
  };
  float lamp_distance(std::size_t lamp) const;  ///< from the probe
  /// Positions one sample size away from a sample without another sample near them: the surface there is clipped in all
  /// frames, or a rim. It may contain a shadow edge.
  std::vector<Eigen::Vector3f> unmeasured_positions_around(std::size_t sample) const;
  /// 1σ of a sample's albedo by noise, texture and smoothing alone.
  float sigma_without_model(std::size_t sample, const SampleAlbedo& albedo) const;
  Interpolated interpolate(const SurfacePoint& point, const std::vector<SampleAlbedo>& samples) const;
  class EdgeTracer;

  const Surface& surface_;
  const IrradianceModel& room_;
  const Illumination& illumination_;
  const std::vector<Eigen::Vector3f>& gathered_;
  float noise_floor_, model_error_;
  std::vector<std::vector<int>> neighbours_;
  std::vector<std::vector<Eigen::Vector3f>> from_lamp_;  ///< irradiance if only known surface occludes it
  UnobservedShadows hidden_;
  // A row per lamp, a column per sample.
  Eigen::ArrayXXf visible_;     ///< fraction of the lamp
  Eigen::ArrayXXf contrast_;    ///< variation of visibility around the sample
  Eigen::ArrayXXi point_rays_;  ///< cast from each of its points; 0: the samples' visibility is interpolated
  std::vector<SampleLight> sample_light_;
};

}  // namespace lumigraft::reconstruct
