#pragma once
// Matching of the lamps in the fish-eye image with the poses of lamp tags.
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "reconstruct/light/light.h"
#include "reconstruct/pose/lamp_tags.h"

namespace lumigraft::reconstruct {

class LampTagMatcher {
 public:
  explicit LampTagMatcher(const capture::Session& session);

  /// Sets PointLight::lamp_tag of lamps that have none: each tag takes the lamp nearest to its direction, within the
  /// uncertainty of both. Ids or regions must distinguish the lamps.
  void identify(const std::vector<LampTagPose>& tags, std::vector<PointLight>& lights,
                const Eigen::Vector3f& probe_m) const;

  struct Result {
    std::vector<PointLight> lights;
    std::vector<std::string> warnings;
  };
  /// The lamps of the image with positions: distance and size from the tag, direction from tag and image, weighted by
  /// their variances. A clipped lamp gets its configured intensity if that is not less. Tagged lamps that the image
  /// does not show are appended, with the last measured intensity, else the configured one, else unknown power;
  /// `id_of(tag)` gives their ids.
  Result place(const Illumination& seen, const std::vector<LampTagPose>& tags, const std::function<int(int)>& id_of);

 private:
  void place_seen(PointLight& lamp, const LampTagPose& tag, const Eigen::Vector3f& probe_m);
  PointLight unseen_lamp(const LampTagPose& tag, const Illumination& seen, std::vector<std::string>& warnings);
  bool in_view(const Eigen::Vector3f& position_m) const;

  std::vector<capture::TaggedLamp> lamps_;
  std::optional<capture::FisheyeCamera> camera_;
  struct Power {
    std::optional<Eigen::Vector3f> seen;   ///< intensity along the normal when last measured
    std::optional<Eigen::Vector3f> guess;  ///< used while the power is neither seen nor configured
  };
  std::vector<Power> powers_;  ///< per lamp
};

/// Whether two results differ by no more than the noise of tag poses.
bool same_places(const std::vector<PointLight>& a, const std::vector<PointLight>& b);

}  // namespace lumigraft::reconstruct
