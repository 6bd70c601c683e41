#pragma once
// What places of earlier frames sent, by cells: to compare what is seen again.
//
// A cell keeps what it sent under two lights. A lamp that is switched on again needs no prediction then: its shadows
// are in what the cell sent when it was lit before.
#include <Eigen/Core>
#include <array>
#include <cstdint>
#include <memory>
#include <unordered_map>
#include <vector>

#include "reconstruct/exposure/places.h"
#include "reconstruct/light/light.h"
#include "reconstruct/math/cell_table.h"

namespace lumigraft::reconstruct {

/// A piece of surface under one light.
struct SurfaceCell {
  Eigen::Vector3f position_m = Eigen::Vector3f::Zero();  ///< tag frame
  Eigen::Vector3f normal = Eigen::Vector3f::Zero();
  Eigen::Array3f radiance = Eigen::Array3f::Zero();  ///< W/sr/m² at gain 1, under `light`
  std::shared_ptr<const Illumination> light;         ///< null: unknown
  Eigen::Array3f around = Eigen::Array3f::Ones();    ///< its mean_irradiance at the probe
  int observations = 0;
  int contradictions = 0;  ///< in a row
  std::uint64_t last_seen = 0;
};

/// What a cell's light is now over what it was when its radiance was stored.
struct LightChange {
  Eigen::Array3f ratio = Eigen::Array3f::Ones();  ///< at the cell, per channel; nothing occludes anything
  float log_sigma = 0;  ///< 1σ of its log: by how much the cell's change differs from that at the probe
};

class SurfaceCells {
 public:
  /// Before a frame is compared: its light; null: unknown.
  void set_light(const std::shared_ptr<const Illumination>& light);
  /// What the place sent under the light nearest to that of the frame; null if it is not seen again.
  const SurfaceCell* find(const Place& place) const;
  LightChange light_change(const SurfaceCell& cell, const std::shared_ptr<const Illumination>& light) const;
  /// Stores or averages the places of a frame; its light may be unknown (null). If its gain is not known, as places
  /// contradict the light, what they send is stored only after kExposure.replaced_after frames in a row.
  void learn(const std::vector<Place>& places, const Eigen::Array3f& gain, bool gain_is_known,
             const std::shared_ptr<const Illumination>& light);
  void clear() {
    cells_.clear();
    numbers_.clear();
  }
  bool empty() const { return cells_.empty(); }

 private:
  using Lights = std::array<SurfaceCell, 2>;  ///< one without observations is empty; the first never is
  std::size_t nearest(const Lights& cell) const;
  /// relative_change between this frame's light and another.
  double change_from(const Illumination* other) const;
  void forget_oldest();

  struct Cell {
    CellKey key;
    Lights lights;
  };
  std::vector<Cell> cells_;
  CellTable numbers_;  ///< of keys in `cells_`
  std::shared_ptr<const Illumination> light_;
  mutable std::unordered_map<const Illumination*, double> changes_;  ///< from `light_`
  Eigen::Array3f around_ = Eigen::Array3f::Ones();                   ///< mean_irradiance of `light_` at the probe
  std::uint64_t frames_ = 0;
};

}  // namespace lumigraft::reconstruct
