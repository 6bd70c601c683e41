#pragma once
// Albedo of surfaces, given the light on them.
//
// For every surface voxel: albedo = π B / E, from the measured radiance B (fused over views) and the modelled
// irradiance E: lamps with visibility through the field, plus gathered light, which is the field's own measured
// radiance (it includes all bounces), the environment as the sides of the enclosure show it, and a floor of typical
// albedo where no camera looked down. Lamp distances follow from pairs of samples (lamps/lamp_placement.h); then Ceres
// solves the albedo of all samples together, robustly, bounded to [0, 1]. The scale of albedo follows from the absolute
// radiance of the fish-eye and the colour camera; no albedo is fixed.
#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "reconstruct/field/distance_field.h"
#include "reconstruct/lamps/kept_lamp.h"
#include "reconstruct/light/light.h"
#include "reconstruct/room/reflected_colors.h"

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
  /// While shadows move the room shows neither where its lamps are nor albedo: lamps that stay keep their estimates,
  /// and only new surface is solved.
  void hold(bool hold);
  /// Call before lamps are solved: where an earlier run of the program found them.
  void restore_lamps(std::vector<KeptLamp> kept);
  /// Those of the last solution with a known place, and those that were restored and did not shine since.
  std::vector<KeptLamp> lamps_to_keep() const;
  struct Result {
    std::shared_ptr<const AlbedoField> albedo = {};
    std::shared_ptr<const Illumination> illumination = {};  ///< the input with lamp distances filled in
    /// Occluders of shadows that no known surface explains (carve_occluders), at the last complete solution; not null.
    std::shared_ptr<const BrickMap<FieldBrick>> occluders = std::make_shared<const BrickMap<FieldBrick>>();
    /// Found at the last complete solution (find_reflecting_planes): their diffuse albedo is 0, and lamps are
    /// estimated without them.
    std::vector<ReflectingPlane> mirrors = {};
    std::vector<std::string> warnings = {};
    bool complete = false;    ///< a complete solution: lamps and all samples
    bool due = false;         ///< a complete one is due: more surface is known, much of it changed, or it is long ago
    std::size_t samples = 0;  ///< number of samples solved
    /// The room reflects more light than the illumination has (reflected_over_possible): this albedo is none.
    bool light_is_missing = false;
  };
  /// Incremental solution if that is as good, else a complete one.
  Result solve(const DistanceField& field, const Illumination& illumination);
  Result solve_complete(const DistanceField& field, const Illumination& illumination);
  /// Only the lamps, where their light changed and albedo is known: those that moved are searched around the distance
  /// that their irradiance implies, those whose share of the light rose much around theirs, the others keep theirs.
  /// Empty if the light is as before, if a lamp is new or much surface, and after some such solutions in a row, as a
  /// complete one learns more of albedo from every other light.
  std::optional<Result> follow_light(const DistanceField& field, const Illumination& illumination);
  /// Solves only the samples of bricks that are new or changed since they were solved; all other samples, lamps and the
  /// surroundings stay fixed. Empty if that is not valid, as a lamp or the environment changed; and, unless
  /// `even_if_due`, if a complete solution is due.
  std::optional<Result> solve_incremental(const DistanceField& field, const Illumination& illumination,
                                          bool even_if_due = true);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace lumigraft::reconstruct
