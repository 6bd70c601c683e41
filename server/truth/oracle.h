#pragma once
// Parts of the scene from a session's truth/, in place of estimates: `replay --oracle pose,geometry,light,albedo`
// shows which part causes which error. The running service never reads truth/.
#include <memory>
#include <string>
#include <vector>

#include "capture/frame.h"
#include "capture/session/session.h"
#include "reconstruct/scene_builder.h"
#include "server/truth/truth.h"

namespace lumigraft::server {

struct OracleParts {
  bool pose = false, geometry = false, light = false, albedo = false;
  bool any() const { return pose || geometry || light || albedo; }
  bool all() const { return pose && geometry && light && albedo; }
};

/// Comma-separated names. Throws InputError.
OracleParts parse_oracle_parts(const std::string& list);
/// "pose+geometry"; "none".
std::string name_of(const OracleParts& parts);

class Oracle {
 public:
  /// Throws InputError where truth/ lacks what `parts` need for frame 0.
  Oracle(const capture::Session& session, const OracleParts& parts);
  ~Oracle();

  const OracleParts& parts() const;
  // What follows throws InputError where truth/ has nothing for the frame.
  reconstruct::Pose pose(const capture::FrameSet& frame) const;
  /// The frame with the true depth in place of the sensor's; without any where truth/ has none for this frame.
  capture::FrameSet with_true_depth(const capture::FrameSet& frame) const;
  /// The light stage's split of the fish-eye picture (the true one, where truth/ has it), in which every lamp that is
  /// a true lamp's picture gives way to that true lamp. A true lamp that the fish-eye does not see is added; one that
  /// it sees and the split left in the remainder stays there, so that no light counts twice. So it is with what the
  /// light stage takes for lamps in truth/environment.exr, where light comes from that; and what the picture holds of
  /// it as a lower bound is as bright as there.
  std::shared_ptr<const reconstruct::Illumination> illumination(const capture::FrameSet& frame);
  /// Around the whole true room. Null where truth/ has no real_scene.ply.
  std::shared_ptr<const reconstruct::Enclosure> enclosure(const reconstruct::Illumination& light) const;
  /// The true albedo picture projected onto the surface voxels of `field` that this frame sees, over what earlier
  /// frames saw.
  std::shared_ptr<const reconstruct::AlbedoField> albedo(const capture::FrameSet& frame, const reconstruct::Pose& pose,
                                                         const reconstruct::DistanceField& field);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

/// What the oracle knows, in place of estimates. Null: nothing.
reconstruct::SceneOverrides overrides_of(std::shared_ptr<Oracle> oracle);

/// `split` with true lamps in place of what it found of them; see Oracle::illumination. `far`: lamps of the
/// environment.
reconstruct::Illumination with_true_lamps(const reconstruct::Illumination& split, const std::vector<TrueLamp>& lamps,
                                          const std::vector<reconstruct::PointLight>& far,
                                          const capture::FisheyeCamera& fisheye);

}  // namespace lumigraft::server
