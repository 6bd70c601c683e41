#pragma once
// What samples gather, kept from one solve to the next.
#include <cstdint>
#include <vector>

#include "reconstruct/shading/irradiance.h"
#include "reconstruct/shading/surface_samples.h"

namespace lumigraft::reconstruct {

/// A sample near one of the solve before gathers what that one did; every kRefresh-th looks again all the same, so that
/// a room that changes slowly is followed. All look again when the light changes by kLightShare, or when so much more
/// of the room is known that rays end elsewhere.
class GatherCache {
 public:
  std::vector<IrradianceModel::Gathered> gather(const IrradianceModel& room, const Illumination& illumination,
                                                const std::vector<SurfaceSample>& samples, std::size_t surface_points,
                                                int rays);
  void forget() { entries_.clear(); }

 private:
  static constexpr std::uint32_t kRefresh = 8;
  static constexpr float kLightShare = 0.05f;
  static constexpr double kGrown = 1.1;

  struct Entry {
    Eigen::Vector3f position, normal;
    IrradianceModel::Gathered light;
    std::uint32_t turn = 0;  ///< looks again when solves reach it, modulo kRefresh
  };
  std::vector<Entry> entries_;
  std::uint32_t solves_ = 0, turns_ = 0;
  float light_ = 0;
  std::size_t points_ = 0;
};

}  // namespace lumigraft::reconstruct
