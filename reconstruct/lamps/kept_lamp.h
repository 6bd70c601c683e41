#pragma once
// Where an earlier run of the program found a lamp. Lamps hang at their places for months, while their light changes
// every day: power, colour and whether it shines are not kept.
#include <Eigen/Core>

namespace lumigraft::reconstruct {

struct KeptLamp {
  Eigen::Vector3f position_m = Eigen::Vector3f::Zero();  ///< tag frame
  float radius_m = 0;
  float distance_log_sigma = 0;  ///< 1σ of log distance from the fish-eye, as published then
  bool flat = false, beam = false;
};

}  // namespace lumigraft::reconstruct
