#pragma once
// What places of earlier frames sent, by cells: to compare what is seen again.
#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <unordered_map>
#include <vector>

#include "reconstruct/exposure/places.h"
#include "reconstruct/field/brick_map.h"
#include "reconstruct/light/light.h"

namespace lumigraft::reconstruct {

/// A piece of surface.
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
  /// Before a frame is compared: mean_irradiance of its light at the probe.
  void set_around(const Eigen::Array3f& mean_irradiance) { around_ = mean_irradiance; }
  /// Null if the place is not seen again.
  const SurfaceCell* find(const Place& place) const;
  LightChange light_change(const SurfaceCell& cell, const std::shared_ptr<const Illumination>& light) const;
  /// Stores or averages the places of a frame; its light may be unknown (null).
  void learn(const std::vector<Place>& places, const Eigen::Array3f& gain,
             const std::shared_ptr<const Illumination>& light);
  void clear() { cells_.clear(); }
  bool empty() const { return cells_.empty(); }

 private:
  struct KeyHash {
    std::size_t operator()(const CellKey& k) const {
      return BrickKeyHash()(BrickKey{k[0], k[1], k[2]}) ^ static_cast<std::size_t>(k[3]) * 50331653u;
    }
  };
  void forget_oldest();

  std::unordered_map<CellKey, SurfaceCell, KeyHash> cells_;
  Eigen::Array3f around_ = Eigen::Array3f::Ones();
  std::uint64_t frames_ = 0;
};

}  // namespace lumigraft::reconstruct
