#pragma once
// The last posterior of the lamps as prior of the next.
#include <Eigen/Core>
#include <algorithm>
#include <optional>
#include <utility>
#include <vector>

#include "reconstruct/lamps/kept_lamp.h"
#include "reconstruct/lamps/lamp_posterior.h"
#include "reconstruct/light/light.h"

namespace lumigraft::reconstruct {

/// Successive solutions see mostly the same room and share their errors, so their information fades, and the published
/// uncertainty is that of a single solution. A lamp whose measured power changed or that is of another shape starts
/// anew; of one that turned in the fish-eye image, which was carried, the intensity is remembered.
///
/// Until a lamp is first solved, a place in its direction that an earlier run of the program kept is a prior of its
/// distance, if the lamp is as large as the one that was there.
class LampMemory {
 public:
  void restore(std::vector<KeptLamp> kept) { kept_ = std::move(kept); }
  /// Those that were restored and did not shine since.
  const std::vector<KeptLamp>& kept() const { return kept_; }
  /// A kept lamp that may be this one; null if there is none.
  const KeptLamp* kept_at(const Eigen::Vector3f& probe_m, const PointLight& light) const;
  /// For lamps of these shapes; empty if none is remembered.
  std::optional<LampPrior> prior(const ShadingModel& model, const std::vector<LampShape>& shapes) const;
  void keep(const ShadingModel& model, const LampPosterior& posterior);
  /// The surface is known by so many times the measurements of the last solution: its errors were that much greater.
  void outweigh(double times) { covariance_ *= std::max(times, 1.0); }
  /// LampPosterior::misfit of the last one; 0 without lamps.
  double misfit() const { return misfit_; }

 private:
  struct Lamp {
    PointLight light;
    LampShape shape;
    Eigen::Vector3f normal;
  };
  /// False if none was kept there.
  bool add_kept(const ShadingModel& model, const PointLight& light, const LampShape& shape, Eigen::Index at,
                LampPrior& prior) const;
  void add_intensity(const PointLight& light, LampShape shape, const Lamp& was, Eigen::Index of, Eigen::Index at,
                     LampPrior& prior) const;
  std::vector<Lamp> lamps_;
  std::vector<KeptLamp> kept_;
  Eigen::MatrixXd covariance_;
  double misfit_ = 0;
};

}  // namespace lumigraft::reconstruct
