#pragma once
// Successive estimates of where lamps stand, put together by their uncertainty.
#include <Eigen/Core>
#include <array>
#include <vector>

#include "reconstruct/lamps/lamp_placement.h"
#include "reconstruct/light/light.h"

namespace lumigraft::reconstruct {

/// An information filter over all lamps together, since their errors hang together: what one solve leaves open along
/// one direction another may tell. Solves see mostly the same room and are wrong alike, so that old ones fade
/// (kKept) and the reported uncertainty is that of one, not of their mean.
///
/// A lamp that the fish-eye saw turn, or change its power where that is measured, starts anew. One of which the room
/// alone says something else must say it twice: a single solve far off changes nothing.
class LampFilter {
 public:
  /// `lights` are those that were solved for, in the same order; PointLight::id says which is which.
  std::vector<LampEstimate> combine(const std::vector<PointLight>& lights, const LampSolution& now);

 private:
  using Parameters = Eigen::Matrix<double, kPerLamp, 1>;  ///< log distance, tilt, log power of three channels
  struct Track {
    int id;
    bool flat, beam, far, clipped;
    Eigen::Vector3f direction, irradiance;  ///< as the fish-eye gave them when the track began
    std::array<Eigen::Vector3f, 2> across;  ///< what tilts are along
    Parameters last;                        ///< as newest solved
    bool contradicted = false;              ///< by the newest solve
  };
  Parameters parameters(const Track& track, const PointLight& light, const LampEstimate& estimate) const;

  std::vector<Track> tracks_;
  Eigen::VectorXd mean_;         ///< kPerLamp for each track
  Eigen::MatrixXd information_;  ///< of as many solves as
  double solves_ = 0;
};

}  // namespace lumigraft::reconstruct
