#pragma once
// Fusion of successive estimates of lamps by their uncertainty.
#include <Eigen/Core>
#include <array>
#include <vector>

#include "reconstruct/lamps/lamp_placement.h"
#include "reconstruct/light/light.h"

namespace lumigraft::reconstruct {

/// An information filter over the parameters of all lamps jointly, as their errors are correlated. Successive solutions
/// see mostly the same room and share their errors, so old information fades, and the reported uncertainty is that of a
/// single solution, not of their mean.
///
/// A lamp that turned in the fish-eye image, or whose measured power changed, starts anew. Where only the solution
/// contradicts, two solutions in a row must agree: a single outlier changes nothing.
class LampFilter {
 public:
  /// `lights`: the lamps of the solution in the same order, identified by PointLight::id.
  std::vector<LampEstimate> combine(const std::vector<PointLight>& lights, const LampSolution& now);

 private:
  using Parameters = Eigen::Matrix<double, kUnknownsPerLamp, 1>;  ///< log distance, tilt, log power of three channels
  struct Track {
    int id;
    bool flat, beam, far, clipped;
    Eigen::Vector3f direction, irradiance;  ///< measured by the fish-eye when the track began
    std::array<Eigen::Vector3f, 2> across;  ///< axes of the tilts
    Parameters last;                        ///< of the newest solution
    bool contradicted = false;              ///< by the newest solution
  };
  /// A solution on its way into the filter; the vectors hold indices of lamps.
  struct Step {
    Eigen::MatrixXd covariance;  ///< its tilts turned to the axes of the tracks
    Eigen::VectorXd values;
    std::vector<Track> tracks;
    std::vector<Eigen::Index> kept, kept_from, counted;  ///< tracks that go on, their old indices; lamps to be fused
  };
  static Parameters parameters(const Track& track, const PointLight& light, const LampEstimate& estimate);
  void follow(const PointLight& light, const LampEstimate& estimate, const Eigen::MatrixXd& before, Step& step) const;
  void fuse(const Eigen::MatrixXd& before, const Step& step);
  LampEstimate report(std::size_t lamp, const PointLight& light, LampEstimate estimate,
                      const Eigen::MatrixXd& covariance) const;

  std::vector<Track> tracks_;
  Eigen::VectorXd mean_;         ///< kUnknownsPerLamp per track
  Eigen::MatrixXd information_;  ///< of solves_ solutions
  double solves_ = 0;            ///< effective number, after fading
};

}  // namespace lumigraft::reconstruct
