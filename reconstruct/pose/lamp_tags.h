#pragma once
// Where lamps stand that carry a tag (Franke 2015, section 5.3.1: light sources that are tracked).
#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "capture/frame.h"
#include "capture/session/session.h"
#include "reconstruct/pose/pose.h"

namespace lumigraft::reconstruct {

/// What a tag says of the lamp that carries it.
struct LampTagPose {
  int lamp = 0;                                          ///< index into Session::lamps
  Eigen::Vector3f position_m = Eigen::Vector3f::Zero();  ///< of the lamp's middle, in the frame of the room's tag
  float sigma_m = 0;                                     ///< 1σ along any axis; grows while the tag is hidden
  Eigen::Vector3f normal = Eigen::Vector3f::Zero();  ///< unit, same frame, where the lamp glows as a plane; else zero
};

/// Finds the tags of the session's lamps in the colour picture and puts them into the room by the camera's pose.
/// A place is the mean over pictures while the lamp stands still (PoseFilter). While its tag is hidden a lamp is held
/// where it was, for kHeldNs; then it has no mark until the tag shows again.
/// Not used, and named in a warning: a tag that depth shows to be of another size, one of several with its number
/// before it is known which, and one that two poses explain so that its lamp is in two places.
class LampTagStage {
 public:
  /// Throws InputError for a tag that does not exist.
  explicit LampTagStage(const capture::Session& session);
  ~LampTagStage();

  static constexpr std::int64_t kHeldNs = 20'000'000'000;

  struct Result {
    std::vector<LampTagPose> marks;  ///< of lamps whose place is known
    std::vector<std::string> warnings;
  };
  /// `pose`: of the camera in this very frame; empty: nothing new is seen.
  Result locate(const capture::FrameSet& frame, const std::optional<Pose>& pose);

 private:
  struct State;
  std::unique_ptr<State> state_;  ///< null where no lamp carries a tag
};

}  // namespace lumigraft::reconstruct
