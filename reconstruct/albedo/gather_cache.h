#pragma once
// Gathered light of samples, kept from one solution to the next.
#include <cstdint>
#include <vector>

#include "reconstruct/shading/irradiance.h"
#include "reconstruct/shading/surface_samples.h"

namespace lumigraft::reconstruct {

/// A sample close to one of the last solution takes its gathered light; a fraction of them is gathered anew in turn, so
/// that slow changes of the room are followed. All are gathered anew when the light changed or much more of the room is
/// known.
class GatherCache {
 public:
  std::vector<IrradianceModel::Gathered> gather(const IrradianceModel& room, const Illumination& illumination,
                                                const std::vector<SurfaceSample>& samples, std::size_t surface_points,
                                                int rays);
  void forget() { entries_.clear(); }

 private:
  struct Entry {
    Eigen::Vector3f position, normal;
    IrradianceModel::Gathered light;
    std::uint32_t turn = 0;  ///< gathered anew when solves_ equals it, modulo the refresh period
  };
  std::vector<Entry> entries_;
  std::uint32_t solves_ = 0, turns_ = 0;
  Illumination light_;  ///< when all were last gathered
  std::size_t points_ = 0;
};

}  // namespace lumigraft::reconstruct
