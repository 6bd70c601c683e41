#pragma once
// What colour surfaces have, given what light falls on them.
//
// For every surface voxel the measured radiance B (fused over views) and the modelled irradiance E (lamps with
// visibility through the field, plus a gather of the field's own measured radiance and of the remainder of the
// fish-eye picture as the enclosure's sides show it: all bounces, since measured radiance holds them; and where no
// camera looked, below, of a floor of usual albedo) give albedo = π B / E. Ceres solves lamps' distances (see light.h)
// by pairs of samples, and then all samples together, robustly, bounded to [0, 1].
// Gauge: the scale of albedo follows from the fish-eye's and the colour camera's absolute radiance; no albedo is fixed.
#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "reconstruct/distance_field.h"
#include "reconstruct/light.h"

namespace lumigraft {

struct AlbedoBrick {
  std::array<Eigen::Vector3f, kBrickVoxels> albedo{};  ///< linear, diffuse
  std::array<float, kBrickVoxels> sigma{};             ///< 1σ of albedo; negative = unknown
};

struct AlbedoField {
  float voxel_m = 0.008f;  ///< the grid of the distance field it was solved on
  std::uint64_t version = 0;
  BrickMap<AlbedoBrick> bricks;
};

class AlbedoStage {
 public:
  explicit AlbedoStage(const Session& session);
  ~AlbedoStage();
  struct Result {
    std::shared_ptr<const AlbedoField> albedo;
    std::shared_ptr<const Illumination> illumination;  ///< the input with lamp distances filled in
    std::vector<std::string> warnings;
  };
  Result solve(const DistanceField& field, const Illumination& illumination);
  void reset();

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace lumigraft
