#pragma once
// Positions of lamps that carry a tag (Franke 2015, section 5.3.1: tracked light sources).
#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "capture/frame.h"
#include "capture/session/session.h"
#include "reconstruct/pose/parameters.h"
#include "reconstruct/pose/pose.h"

namespace lumigraft::reconstruct {

/// Pose of a lamp from its tag.
struct LampTagPose {
  int lamp = 0;                                          ///< index into Session::lamps
  Eigen::Vector3f position_m = Eigen::Vector3f::Zero();  ///< the lamp's centre, in the frame of the room's tag
  float sigma_m = 0;                                     ///< 1σ along any axis; grows while the tag is hidden
  Eigen::Vector3f normal =
      Eigen::Vector3f::Zero();  ///< unit, same frame, for a lamp that emits from a plane; else zero
};

/// Detects the tags of the session's lamps in the colour image and transforms them into the room by the camera pose.
/// A position is the mean over frames while the lamp is at rest (PoseFilter). While its tag is hidden a lamp keeps its
/// position for kHeldNs; then it has none until the tag is seen again.
/// Not used, with a warning: a tag whose size contradicts depth, several tags with one id before it is known which is
/// meant, and a tag with two poses that place its lamp differently.
class LampTagStage {
 public:
  /// Throws InputError for a family or id that does not exist.
  explicit LampTagStage(const capture::Session& session);
  ~LampTagStage();

  static constexpr std::int64_t kHeldNs = kLampTags.held_ns;

  struct Result {
    std::vector<LampTagPose> marks;  ///< of lamps whose position is known
    std::vector<std::string> warnings;
  };
  /// `pose`: of the camera in this frame; empty: the image is not used.
  Result locate(const capture::FrameSet& frame, const std::optional<Pose>& pose);

 private:
  struct State;
  std::unique_ptr<State> state_;  ///< null if no lamp has a tag
};

}  // namespace lumigraft::reconstruct
