#pragma once
// The fish-eye picture split into lamps and the rest. No energy is counted twice: the lamps' irradiance plus the
// environment integrates to the picture.
#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "capture/frame.h"
#include "capture/session/session.h"
#include "reconstruct/math/spherical_harmonics.h"
#include "reconstruct/pose/lamp_tags.h"

namespace lumigraft::reconstruct {

/// A lamp. The fish-eye gives direction, size and irradiance at its place; shading of the room gives the distance, or
/// the tag that the lamp carries. While `distance_known` is false the lamp counts as infinitely far.
struct PointLight {
  int id = 0;                                            ///< stable over time
  Eigen::Vector3f direction = Eigen::Vector3f::UnitZ();  ///< unit, tag frame, from the probe to the lamp
  Eigen::Vector3f irradiance = Eigen::Vector3f::Zero();  ///< W/m² per channel at the probe, facing the lamp
  float angular_radius_rad = 0;                          ///< of the disk with the same solid angle, at the probe
  bool distance_known = false;
  Eigen::Vector3f position_m = Eigen::Vector3f::Zero();  ///< tag frame; where distance_known
  Eigen::Vector3f intensity = Eigen::Vector3f::Zero();   ///< radiant intensity, W/sr per channel; where distance_known
  float radius_m = 0;                                    ///< where distance_known
  bool clipped = false;       ///< in the picture: its power is a lower bound, or was found from how the room is shaded
  float power_log_sigma = 0;  ///< 1σ of log irradiance; where it was found
  float distance_log_sigma = 0;                      ///< 1σ of log distance; where distance_known
  float squareness = 0;                              ///< of its outline: 0 a disk, 0.43 a quadrilateral
  int region = -1;                                   ///< the same for pieces of one wide lamp; -1: no piece
  bool flat = false;                                 ///< emits as a plane does, with the cosine; else evenly
  Eigen::Vector3f normal = Eigen::Vector3f::Zero();  ///< unit, tag frame; where flat (and distance_known)
  int mark = -1;  ///< index into Session::lamps of what its tag says that it is; -1: none says so
  /// What the fish-eye's picture says of a lamp that its tag puts there. `outside` of its view, and `dark` where it is
  /// hidden from the fish-eye or switched off: then irradiance is that of a free sight, a guess, and power_log_sigma
  /// says how good (kUnknownPower: none). The shading of the room tells more.
  enum class Shown { yes, outside, dark } shown = Shown::yes;
  int hidden = 0;  ///< pictures since it was last seen: it is held, then faded out; 0 where the newest shows it

  /// Radiant intensity towards a unit direction (from the lamp on), over `intensity`, which is that towards the probe:
  /// 1 where not flat, else max(0, n·ω) / (n·ω_probe).
  float emission(const Eigen::Vector3f& towards) const;
};

constexpr float kUnknownPower = 10;  ///< power_log_sigma of a power of which nothing is known
/// A panel that the probe sees at a slant sends more straight ahead than was seen of it: this cosine bounds how much.
/// As relight has it.
constexpr float kLeastSlant = 0.1f;

/// Radiance as a latitude-longitude picture: column u is azimuth φ = 2π (u + 0.5)/width - π (φ = atan2(y, x)), row v is
/// polar angle θ = π (v + 0.5)/height from +z (tag frame). Directions no camera saw hold the mean of what was seen
/// nearest to them.
struct EnvironmentMap {
  capture::Image<float> radiance;
  capture::Image<std::uint8_t> seen = {};     ///< 1 channel: 0 where no camera saw; empty where all was seen
  capture::Image<std::uint8_t> clipped = {};  ///< 1 channel: not 0 where it is a lower bound; empty where it nowhere is
  Eigen::Vector3f sample(const Eigen::Vector3f& direction) const;  ///< bilinear
};

struct Illumination {
  Eigen::Vector3f probe_position_m = Eigen::Vector3f::Zero();  ///< where the fish-eye stands, tag frame
  std::vector<PointLight> lights;                              ///< strongest first
  EnvironmentMap environment;                                  ///< everything but the lamps
  Sh9 environment_sh{};                                        ///< the same, projected
  double clipped_fraction = 0;                                 ///< share of the fish-eye's pixels that are clipped
  std::uint64_t version = 0;
};

struct LightSettings {
  int max_lights = 8;
};

class LightStage {
 public:
  LightStage(const capture::Session& session, const LightSettings& settings);
  ~LightStage();
  struct Result {
    std::shared_ptr<const Illumination>
        illumination;  ///< the last one again where the frame has no fish-eye; may be null
    std::vector<std::string> warnings;
  };
  /// `marks`: where lamps stand that carry tags, in this very frame.
  Result extract(const capture::FrameSet& frame, const std::vector<LampTagPose>& marks = {});

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace lumigraft::reconstruct
