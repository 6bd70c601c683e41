#pragma once
// Linear rows of the prior of the lamps' unknowns (docs/light_posterior.md), kUnknownsPerLamp per lamp: inverse
// distance, 1/m; tilt; log gain by channel.
#include <Eigen/Core>
#include <vector>

#include "reconstruct/lamps/shading_model.h"

namespace lumigraft::reconstruct {

/// Residuals A x - b: the linear rows of the prior.
struct LinearRows {
  Eigen::MatrixXd a;
  Eigen::VectorXd b;

  explicit LinearRows(Eigen::Index unknowns) : a(0, unknowns) {}
  Eigen::RowVectorXd zero() const { return Eigen::RowVectorXd::Zero(a.cols()); }
  void add(const Eigen::RowVectorXd& row, double value, double sigma) {
    a.conservativeResize(a.rows() + 1, Eigen::NoChange);
    b.conservativeResize(b.size() + 1);
    a.bottomRows<1>() = row / sigma;
    b[b.size() - 1] = value / sigma;
  }
};

inline Eigen::Index first_of(std::size_t lamp) { return static_cast<Eigen::Index>(kUnknownsPerLamp * lamp); }

/// 1/m, of a lamp on a ceiling of usual height; 0 for a light below the horizon.
double usual_inverse_distance(const PointLight& light);

/// Normal distribution of all unknowns. Zero information: unknown.
struct LampPrior {
  Eigen::VectorXd mean;
  Eigen::MatrixXd information;
  std::vector<LinearRows> intensities = {};  ///< of lamps that moved, linearized; each may have changed
};

/// Distance, a panel that faces the probe, and level and colour of a lamp whose power is unknown.
void add_wide_rows(const ShadingModel& model, LinearRows& rows);

/// Clipped lamps of one kind in a room usually have equal radiance and colour, and all of them radiance of one order.
/// Where shading determines their sum but not each of them, this divides it.
void add_alike_rows(const ShadingModel& model, const std::vector<LampShape>& shapes, LinearRows& rows);

/// Rows of heights, each of which may be far off: a lamp at the usual height over the probe, and a clipped lamp at the
/// height of its kind.
std::vector<LinearRows> height_rows(const ShadingModel& model, const std::vector<LampShape>& shapes);

LinearRows prior_rows(const LampPrior& prior);

}  // namespace lumigraft::reconstruct
