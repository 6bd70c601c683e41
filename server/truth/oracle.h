#pragma once
// Replaces estimated parts of the scene by those of a session's truth/: `replay --oracle pose,geometry,light,albedo`
// shows which part causes which error. The running service never reads truth/.
#include <array>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "capture/frame.h"
#include "capture/session/session.h"
#include "reconstruct/scene_builder.h"
#include "server/truth/true_environment.h"
#include "server/truth/true_surface.h"
#include "server/truth/truth.h"

namespace lumigraft::server {

struct OracleParts {
  bool pose = false, geometry = false, light = false, albedo = false;
  bool any() const { return pose || geometry || light || albedo; }
  bool all() const { return pose && geometry && light && albedo; }
};

inline constexpr std::array<std::pair<const char*, bool OracleParts::*>, 4> kOracleParts = {
    {{"pose", &OracleParts::pose},
     {"geometry", &OracleParts::geometry},
     {"light", &OracleParts::light},
     {"albedo", &OracleParts::albedo}}};

/// Parses comma-separated names. Throws InputError.
OracleParts parse_oracle_parts(const std::string& list);
/// Such as "pose+geometry", or "none".
std::string name_of(const OracleParts& parts);

class Oracle {
 public:
  /// Throws InputError where truth/ lacks what `parts` need for frame 0.
  Oracle(const capture::Session& session, const OracleParts& parts);

  const OracleParts& parts() const { return parts_; }
  // These throw InputError where truth/ has no data for the frame.
  reconstruct::Pose pose(const capture::FrameSet& frame) const;
  /// The frame with the true depth in place of the sensor's; without depth where truth/ has none for this frame.
  capture::FrameSet with_true_depth(const capture::FrameSet& frame) const;
  /// The light stage's result for the fish-eye picture (the true picture, where truth/ has one), in which every
  /// detected lamp that matches a true lamp is replaced by the true lamp. A true lamp outside the fish-eye's view is
  /// added; one in view that the split left in the environment residual stays there, so that no light counts twice.
  /// Lamps that the light stage detects in truth/environment.exr are treated the same way, and pixels that are lower
  /// bounds (clipped) get the radiance of truth/environment.exr.
  std::shared_ptr<const reconstruct::Illumination> illumination(const capture::FrameSet& frame);
  /// The enclosure of the whole true room. Null where truth/ has no real_scene.ply.
  std::shared_ptr<const reconstruct::Enclosure> enclosure(const reconstruct::Illumination& light) const;
  /// The true albedo picture projected onto the surface voxels of `field` visible in this frame, accumulated over
  /// frames.
  std::shared_ptr<const reconstruct::AlbedoField> albedo(const capture::FrameSet& frame, const reconstruct::Pose& pose,
                                                         const reconstruct::DistanceField& field);

 private:
  std::filesystem::path file(std::uint64_t index, const char* name) const;
  capture::FisheyeFrames fisheye(const capture::FrameSet& frame) const;

  capture::Session session_;
  OracleParts parts_;
  reconstruct::LightStage light_;
  std::shared_ptr<const reconstruct::AlbedoField> albedo_;
  std::optional<TrueSurface> surface_;  ///< of the whole true room
  std::optional<TrueEnvironment> environment_;
};

/// The oracle's true parts of the scene as overrides of estimates. Null: none.
reconstruct::SceneOverrides overrides_of(const std::shared_ptr<Oracle>& oracle);

/// `split` with true lamps in place of what it found of them; see Oracle::illumination. `far`: lamps of the
/// environment.
reconstruct::Illumination with_true_lamps(const reconstruct::Illumination& split, const std::vector<TrueLamp>& lamps,
                                          const std::vector<reconstruct::PointLight>& far,
                                          const capture::FisheyeCamera& fisheye);

}  // namespace lumigraft::server
