#pragma once
// The model that explains what pairs of samples show: lamps with a distance and a shape, visibility from tables.
#include <Eigen/Core>
#include <array>
#include <vector>

#include "reconstruct/lamps/sample_pairs.h"
#include "reconstruct/light/light.h"
#include "reconstruct/shading/irradiance.h"
#include "reconstruct/shading/surface_samples.h"

namespace lumigraft::reconstruct {

/// A lamp's unknowns: log distance, and where it is flat its normal as ω + tilt₀ t₀ + tilt₁ t₁ (not unit), ω the
/// direction from lamp to probe and t₀, t₁ across it.
struct LampShape {
  double log_distance = 0;
  bool flat = false;
  std::array<double, 2> tilt{};
  std::array<double, 3> log_gain{};  ///< of a clipped lamp: true over measured irradiance, per channel
  bool beam = false;                 ///< and flat: what it sends falls with the fourth power of the cosine
  bool far = false;                  ///< its distance is not looked for
};

/// Over a lamp's disk, for visibility that is to be fine.
constexpr int kFineRays = 5;

constexpr int kPerLamp = 6;  ///< numbers in it, but for its kind: log distance, tilt, log gain

enum class Search { rough, fine };  ///< rough: not to the last digit, for a start

class ShadingModel {
 public:
  ShadingModel(const IrradianceModel& room, const Illumination& illumination, const std::vector<SurfaceSample>& samples,
               const std::vector<Eigen::Vector3f>& gathered);

  std::size_t lamps() const { return lights_.size(); }
  const PointLight& light(std::size_t lamp) const { return lights_[lamp]; }
  /// Whether the lamp's distance is not looked for, since its tag says it; where it then glows as a plane, its normal
  /// too.
  bool placed(std::size_t lamp) const { return lights_[lamp].distance_known; }
  double log_distance_of(const PointLight& placed) const;

  /// Visibility of the lamp from every sample at each of these distances (rising evenly), `rays` rays over the lamp's
  /// disk.
  void tabulate(std::size_t lamp, std::vector<double> log_distances, int rays);
  const std::vector<double>& tabulated(std::size_t lamp) const { return tables_[lamp].log_distances; }

  Eigen::Vector3f normal(std::size_t lamp, const LampShape& shape) const;  ///< unit
  std::array<double, 2> tilt_of(std::size_t lamp, const Eigen::Vector3f& normal) const;

  /// Irradiance factor of every sample, visibility smoothed over neighbouring distances.
  void factors(std::size_t lamp, const LampShape& shape, std::vector<float>& result) const;

  /// Irradiance of a lamp at the probe, with its gain.
  Eigen::Array3f power(std::size_t lamp, const LampShape& shape) const;
  /// log B - log E of every sample for these powers and factors, per lamp.
  void log_albedo(const std::vector<Eigen::Array3f>& powers, const std::vector<std::vector<float>>& factors,
                  std::vector<Eigen::Array3f>& result) const;
  /// How much a sample says, 0 to 1: nothing where neither light nor picture reaches it.
  float told(std::size_t sample, const std::vector<Eigen::Array3f>& powers,
             const std::vector<std::vector<float>>& factors) const;
  /// What holds the scale of albedo: the value of the sample that is paper, or where that is -1 the mean of all usable.
  Eigen::Array3f gauged(const std::vector<Eigen::Array3f>& values, int paper) const;
  /// ∂ log_albedo / ∂ E of a sample.
  Eigen::Array3f slope(std::size_t sample, const std::vector<Eigen::Array3f>& powers,
                       const std::vector<std::vector<float>>& factors) const;

 private:
  struct Table {
    std::vector<double> log_distances;
    std::vector<std::vector<float>> visibility;  ///< per distance, per sample
  };
  Eigen::Vector3f axis(std::size_t lamp, const LampShape& shape) const;
  Eigen::Array3f irradiance(std::size_t sample, const std::vector<Eigen::Array3f>& powers,
                            const std::vector<std::vector<float>>& factors) const;

  const IrradianceModel& room_;
  Eigen::Vector3f probe_;
  std::vector<PointLight> lights_;
  std::vector<std::array<Eigen::Vector3f, 2>> across_;
  const std::vector<SurfaceSample>& samples_;
  const std::vector<Eigen::Vector3f>& gathered_;
  float dark_;  ///< radiance that counts as black
  std::vector<Eigen::Array3f> log_radiance_;
  std::vector<Table> tables_;
};

}  // namespace lumigraft::reconstruct
