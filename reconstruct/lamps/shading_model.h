#pragma once
// Forward model of the samples' shading: lamps with distance and shape, visibility from tables.
#include <Eigen/Core>
#include <array>
#include <vector>

#include "reconstruct/lamps/sample_pairs.h"
#include "reconstruct/light/light.h"
#include "reconstruct/shading/irradiance.h"
#include "reconstruct/shading/surface_samples.h"

namespace lumigraft::reconstruct {

/// The unknowns of a lamp: inverse distance (0 is infinitely far); if flat, its normal as ω + tilt₀ t₀ + tilt₁ t₁ (not
/// unit) with ω the direction from lamp to probe and t₀, t₁ orthogonal to it; and log gain.
struct LampShape {
  double inverse_distance = 0;  ///< from the probe, 1/m
  bool flat = false;
  std::array<double, 2> tilt{};
  std::array<double, 3> log_gain{};  ///< of a clipped lamp: true over measured irradiance
  bool beam = false;                 ///< then also flat: emission falls with cosine⁴
  bool far = false;                  ///< infinitely; its distance is fixed,
  bool weak = false;                 ///< and so is that of a lamp that hardly lights the samples, and its tilt;
  bool held = false;                 ///< or all of it

  /// m of docs/light_posterior.md.
  double emission_exponent() const { return beam ? 4 : flat ? 1 : 0; }
};

constexpr int kUnknownsPerLamp = 6;  ///< inverse distance, two tilts, log gain of three channels

enum class Search { rough, fine };  ///< rough: loose tolerance, as a start

class ShadingModel {
 public:
  ShadingModel(const IrradianceModel& room, const Illumination& illumination, const std::vector<SurfaceSample>& samples,
               const std::vector<Eigen::Vector3f>& gathered);

  const Eigen::Vector3f& probe_m() const { return probe_; }
  std::size_t lamps() const { return lights_.size(); }
  std::size_t samples() const { return samples_.size(); }
  const SurfaceSample& sample(std::size_t i) const { return samples_[i]; }
  const PointLight& light(std::size_t lamp) const { return lights_[lamp]; }
  /// Whether a tag gives the lamp's position, and its normal if it is flat; these are then no unknowns.
  bool placed(std::size_t lamp) const { return lights_[lamp].distance_known; }
  double inverse_distance_of(const PointLight& placed) const;

  /// Tabulates the visible fraction of the lamp from every sample at evenly rising inverse distances, with `rays` rays
  /// over the lamp's disk: from samples in a penumbra, which are those whose neighbours see its centre otherwise than
  /// they do and, from these on, the neighbours of all that see a part of the disk. Shadows move in proportion to
  /// inverse distance.
  void tabulate(std::size_t lamp, std::vector<double> inverse_distances, int rays);
  const std::vector<double>& tabulated(std::size_t lamp) const { return tables_[lamp].inverse_distances; }

  Eigen::Vector3f normal(std::size_t lamp, const LampShape& shape) const;  ///< unit
  std::array<double, 2> tilt_of(std::size_t lamp, const Eigen::Vector3f& normal) const;

  /// Irradiance of every sample over that at the probe; visibility is smoothed over neighbouring distances.
  void factors(std::size_t lamp, const LampShape& shape, std::vector<float>& result) const;

  /// Irradiance of a lamp at the probe, with its gain.
  Eigen::Array3f power(std::size_t lamp, const LampShape& shape) const;
  /// Irradiance of every sample for these powers and factors, per lamp, without the lamp `without` (-1: all).
  std::vector<Eigen::Array3f> irradiance(const std::vector<Eigen::Array3f>& powers,
                                         const std::vector<std::vector<float>>& factors, int without = -1) const;
  /// log B - log E of every sample for the irradiance of the other lamps and one lamp's power and factors; after them
  /// the log of their known albedo, where they have one.
  void log_albedo(const std::vector<Eigen::Array3f>& others, const Eigen::Array3f& power,
                  const std::vector<float>& factors, std::vector<Eigen::Array3f>& result) const;
  /// The same for all lamps.
  void log_albedo(const std::vector<Eigen::Array3f>& powers, const std::vector<std::vector<float>>& factors,
                  std::vector<Eigen::Array3f>& result) const;
  /// Weight of a sample, 0 to 1: 0 where both modelled and measured radiance are below the noise floor.
  float information_weight(std::size_t sample, const std::vector<Eigen::Array3f>& powers,
                           const std::vector<std::vector<float>>& factors) const;
  /// Value that the prior of the albedo scale refers to: of the sample `paper`, or if -1 the mean of all usable
  /// samples.
  Eigen::Array3f scale_reference(const std::vector<Eigen::Array3f>& values, int paper) const;
  /// ∂ log_albedo / ∂ E of a sample.
  Eigen::Array3f slope(std::size_t sample, const std::vector<Eigen::Array3f>& powers,
                       const std::vector<std::vector<float>>& factors) const;

 private:
  struct Table {
    std::vector<double> inverse_distances;
    std::vector<std::vector<float>> visibility;  ///< per distance, per sample
  };
  /// Of a lamp, from every sample.
  std::vector<float> visibility(std::size_t lamp, float distance_m, int rays) const;
  Eigen::Vector3f axis(std::size_t lamp, const LampShape& shape) const;
  Eigen::Array3f irradiance(std::size_t sample, const std::vector<Eigen::Array3f>& powers,
                            const std::vector<std::vector<float>>& factors) const;

  const IrradianceModel& room_;
  Eigen::Vector3f probe_;
  std::vector<PointLight> lights_;
  std::vector<std::array<Eigen::Vector3f, 2>> across_;
  const std::vector<SurfaceSample>& samples_;
  const std::vector<Eigen::Vector3f>& gathered_;
  float noise_floor_;  ///< radiance
  std::vector<Eigen::Array3f> log_radiance_, log_known_;
  std::vector<Table> tables_;
  std::vector<std::vector<int>> neighbours_;  ///< of each sample
};

}  // namespace lumigraft::reconstruct
