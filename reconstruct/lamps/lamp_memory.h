#pragma once
// The last posterior of the lamps as prior of the next.
#include <Eigen/Core>
#include <optional>
#include <vector>

#include "reconstruct/lamps/lamp_posterior.h"
#include "reconstruct/light/light.h"

namespace lumigraft::reconstruct {

/// Successive solutions see mostly the same room and share their errors, so their information fades, and the published
/// uncertainty is that of a single solution. A lamp whose measured power changed or that is of another shape starts
/// anew; of one that turned in the fish-eye image, which was carried, the intensity is remembered.
class LampMemory {
 public:
  /// For lamps of these shapes; empty if none is remembered.
  std::optional<LampPrior> prior(const ShadingModel& model, const std::vector<LampShape>& shapes) const;
  void keep(const ShadingModel& model, const LampPosterior& posterior);
  /// LampPosterior::misfit of the last one; 0 without lamps.
  double misfit() const { return misfit_; }

 private:
  struct Lamp {
    PointLight light;
    LampShape shape;
    Eigen::Vector3f normal;
  };
  void add_intensity(const PointLight& light, LampShape shape, const Lamp& was, Eigen::Index of, Eigen::Index at,
                     LampPrior& prior) const;
  std::vector<Lamp> lamps_;
  Eigen::MatrixXd covariance_;
  double misfit_ = 0;
};

}  // namespace lumigraft::reconstruct
