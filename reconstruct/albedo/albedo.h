#pragma once
// What colour surfaces have, given what light falls on them.
//
// For every surface voxel the measured radiance B (fused over views) and the modelled irradiance E (lamps with
// visibility through the field, plus a gather of the field's own measured radiance and of the environment of the
// fish-eye picture as the enclosure's sides show it: all bounces, since measured radiance holds them; and where no
// camera looked, below, of a floor of usual albedo) give albedo = π B / E. Ceres solves lamps' distances (see light.h)
// by pairs of samples, and then all samples together, robustly, bounded to [0, 1].
// Gauge: the scale of albedo follows from the fish-eye's and the colour camera's absolute radiance; no albedo is fixed.
#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "reconstruct/field/distance_field.h"
#include "reconstruct/light/light.h"

namespace lumigraft::reconstruct {

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
  explicit AlbedoStage(const capture::Session& session);
  ~AlbedoStage();
  struct Result {
    std::shared_ptr<const AlbedoField> albedo;
    std::shared_ptr<const Illumination> illumination;  ///< the input with lamp distances filled in
    std::vector<std::string> warnings;
    bool whole = false;       ///< lamps and all samples were solved
    bool due = false;         ///< they should be: a tenth more surface is known, a quarter of it changed, or long ago
    std::size_t samples = 0;  ///< that were solved
  };
  /// Solves what is new alone where that is as good, else everything.
  Result solve(const DistanceField& field, const Illumination& illumination);
  Result solve_all(const DistanceField& field, const Illumination& illumination);
  /// Solves the samples of the bricks that are new or changed since they were solved, with all others, the lamps and
  /// what lies beyond the surface as they are: prior knowledge that is not touched. Empty where that does not hold,
  /// since a lamp moved or changed, or the other light.
  std::optional<Result> solve_new(const DistanceField& field, const Illumination& illumination);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace lumigraft::reconstruct
