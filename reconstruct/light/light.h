#pragma once
// Light of the room from the fish-eye image: lamps and a residual environment. The irradiance of the lamps plus the
// environment integrates to the image; no energy is counted twice.
#include <Eigen/Core>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "capture/frame.h"
#include "capture/session/session.h"
#include "reconstruct/math/spherical_harmonics.h"
#include "reconstruct/pose/lamp_tags.h"

namespace lumigraft::reconstruct {

/// A lamp. The fish-eye measures direction, size and irradiance at the probe; shading of the room, or a tag on the
/// lamp, gives the distance. While `distance_known` is false the lamp counts as infinitely far.
struct PointLight {
  int id = 0;                                            ///< stable over time
  Eigen::Vector3f direction = Eigen::Vector3f::UnitZ();  ///< unit, tag frame, from the probe to the lamp
  Eigen::Vector3f irradiance = Eigen::Vector3f::Zero();  ///< W/m² per channel at the probe, facing the lamp
  float angular_radius_rad = 0;                          ///< of the disk with the same solid angle, at the probe
  bool distance_known = false;
  Eigen::Vector3f position_m = Eigen::Vector3f::Zero();  ///< tag frame; if distance_known
  Eigen::Vector3f intensity = Eigen::Vector3f::Zero();   ///< radiant intensity, W/sr per channel; if distance_known
  float radius_m = 0;                                    ///< if distance_known
  bool clipped = false;  ///< clipped in the image: power is a lower bound, or was estimated from shading
  /// Something hides a part or all of it from the fish-eye, and the lamp is as it was when all of it was last seen
  /// (LightTracker): direction, size and irradiance are those of then.
  bool covered = false;
  float power_log_sigma = 0;     ///< 1σ of log irradiance, if estimated
  float distance_log_sigma = 0;  ///< 1σ of log distance, if distance_known
  float squareness = 0;          ///< of the outline (SplitLamp): 0 a disk, 0.43 a quadrilateral
  /// Conjugate half axes of the outline (SplitLamp), tangents at the probe; zero: a disk.
  Eigen::Vector3f outline_u = Eigen::Vector3f::Zero(), outline_v = Eigen::Vector3f::Zero();
  int region = -1;                                   ///< equal for the pieces of one wide lamp; -1: not a piece
  bool flat = false;                                 ///< emits with the cosine to its normal; else isotropically
  Eigen::Vector3f normal = Eigen::Vector3f::Zero();  ///< unit, tag frame; if flat and distance_known
  int lamp_tag = -1;  ///< index into Session::lamps of the tagged lamp that this is; -1: none
  /// Whether the fish-eye measures the lamp. Only lamps with a tag can be `outside_view` of the fish-eye, or `dark`:
  /// occluded from it or switched off. Their irradiance is that of an unoccluded lamp, a prior value with
  /// power_log_sigma (kUnknownPowerLogSigma: none); shading of the room determines it better. A dark lamp gives no
  /// light before that (lamp_irradiance); of those that shading shows to shine none is dark (OutOfViewLamps).
  enum class Visibility { visible, outside_view, dark } visibility = Visibility::visible;
  /// Frames since it was last seen, or shown to be lit by what the colour camera sees (LightStage::resolve). It
  /// is held, then faded out. 0 if the newest frame shows it.
  int hidden = 0;

  /// Radiant intensity in a unit direction (away from the lamp) over `intensity`, which is that towards the probe: 1
  /// if not flat, else max(0, n·ω) / (n·ω_probe).
  float emission(const Eigen::Vector3f& towards) const;
};

/// Null if none has this id.
const PointLight* lamp_with_id(const std::vector<PointLight>& lights, int id);

/// Power of the light over that in the fish-eye's newest image, per channel.
struct Dimming {
  std::int64_t since_ns = 0;            ///< Illumination::time_ns of that image
  std::map<int, Eigen::Array3f> lamps;  ///< by id
  Eigen::Array3f environment;
};

/// What the colour camera shows of light that the fish-eye does not see.
struct SeenByColor {
  std::vector<int> off, lit;       ///< lamps that the fish-eye no longer sees, by id
  std::optional<Dimming> dimming;  ///< of all light, while the fish-eye delivers no image
};

float angle_between(const Eigen::Vector3f& a, const Eigen::Vector3f& b);  ///< in radians; a and b unit

constexpr float kUnknownPowerLogSigma = 10;  ///< power_log_sigma of an unknown power
/// Lower bound of a panel's n·ω_probe. Seen at a slant its normal intensity is extrapolated by 1/cosine; this bounds
/// the factor to 10. Same value as in relight.
constexpr float kMinSlantCosine = 0.1f;

/// Radiance as a latitude-longitude map: column u is azimuth φ = 2π (u + 0.5)/width - π (φ = atan2(y, x)), row v is
/// polar angle θ = π (v + 0.5)/height from +z (tag frame). Cells outside the fish-eye's view hold the mean of the
/// nearest cells inside.
struct EnvironmentMap {
  capture::Image<float> radiance;
  capture::Image<std::uint8_t> seen = {};     ///< 1 channel: 0 outside the view; empty if all is inside
  capture::Image<std::uint8_t> clipped = {};  ///< 1 channel: not 0 where radiance is a lower bound; may be empty
  Eigen::Vector3f sample(const Eigen::Vector3f& direction) const;  ///< bilinear
};

struct Illumination {
  Eigen::Vector3f probe_position_m = Eigen::Vector3f::Zero();  ///< of the fish-eye, tag frame
  std::vector<PointLight> lights;                              ///< strongest first
  EnvironmentMap environment;                                  ///< residual: everything but the lamps
  Sh9 environment_sh = zero_sh();                              ///< its spherical harmonics
  double clipped_fraction = 0;                                 ///< of the fish-eye's pixels
  bool from_shading = false;  ///< without a fish-eye: an uncertain estimate from what the colour camera sees
  bool dimmed = false;        ///< changed since the fish-eye's image as the colour camera shows (Dimming)
  std::int64_t time_ns = 0;   ///< of the fish-eye frame; frames that repeat it to the bit do not count
  std::uint64_t version = 0;
};

/// Warnings while no fish-eye has delivered an image.
inline constexpr const char* kLightUnknown = "no fish-eye frame: the light is unknown";
inline constexpr const char* kLightFromShading =
    "no fish-eye frame: the light is estimated from the shading of the room that the colour camera sees, and uncertain";
inline constexpr const char* kLightIsHidden =
    "the fish-eye does not see what lights the room, which reflects more light than its image has: something may stand "
    "between it and a lamp, or the exposure of one camera is not as the session says; the light is estimated from the "
    "shading that the colour camera sees, and uncertain";

class LightStage {
 public:
  explicit LightStage(const capture::Session& session);
  ~LightStage();
  struct Result {
    /// The last pointer again if there is no new fish-eye picture; may be null.
    std::shared_ptr<const Illumination> illumination;
    std::vector<std::string> warnings;
  };
  /// `color`: of about the same moment, or null; `color_gain`: mean of its FrameSet::color_gain. `tags`: poses of the
  /// lamps that carry tags, at that moment.
  Result extract(const capture::FisheyeFrames& fisheye, const capture::Frame* color,
                 const std::vector<LampTagPose>& tags, float color_gain = 1);
  /// Call with ColorGainStage::Result::light: lamps that are off go at once, those that are lit are held on, dimming
  /// holds until an image of the fish-eye. The next `extract` returns the new light, if it has no new image, too.
  void resolve(const SeenByColor& light);
  Result extract(const capture::FrameSet& frame, const std::vector<LampTagPose>& tags = {}) {
    return extract(frame.fisheye, frame.color.get(), tags);
  }

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// Sum of the changes of all lamps' irradiance vectors at the probe and of the environment's mean irradiance, over all
/// irradiance of the two. Lamps are matched by id; one without a counterpart counts whole. A turned lamp counts by the
/// change of its vector. 0 to 2.
double relative_change(const Illumination& now, const Illumination& before);

}  // namespace lumigraft::reconstruct
