#pragma once
// Lamps that the fish-eye sees and lamps whose tags say where they are, put together.
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "reconstruct/light/light.h"
#include "reconstruct/pose/lamp_tags.h"

namespace lumigraft::reconstruct {

class TaggedLights {
 public:
  explicit TaggedLights(const capture::Session& session);

  /// Says which lamps of the picture are the marked ones (PointLight::mark) where that is not known yet: the nearest to
  /// where the mark puts it, within what is unsure of both. Ids or regions must tell the lamps apart.
  void identify(const std::vector<LampTagPose>& marks, std::vector<PointLight>& lights,
                const Eigen::Vector3f& probe_m) const;

  struct Result {
    std::vector<PointLight> lights;
    std::vector<std::string> warnings;
  };
  /// Lamps as seen, with places: distance and size by the mark, direction by mark and picture, each as sure as it is.
  /// One that is clipped has the configured intensity where that is no less. Marked lamps that the picture does not
  /// show follow, with the intensity that they had when last seen, else the configured one; or of unknown power.
  /// `id_of` gives them the ids of their marks.
  Result place(const Illumination& seen, const std::vector<LampTagPose>& marks, const std::function<int(int)>& id_of);

 private:
  void place_seen(PointLight& lamp, const LampTagPose& mark, const Eigen::Vector3f& probe_m);
  PointLight unseen(const LampTagPose& mark, const Illumination& seen, std::vector<std::string>& warnings);
  bool in_view(const Eigen::Vector3f& position_m) const;

  std::vector<capture::TaggedLamp> lamps_;
  std::optional<capture::FisheyeCamera> camera_;
  struct Power {
    std::optional<Eigen::Vector3f> seen;   ///< intensity straight ahead when the picture last showed it
    std::optional<Eigen::Vector3f> guess;  ///< the same where nothing is known
  };
  std::vector<Power> powers_;  ///< of each lamp
};

/// Whether two results are the same but for the noise of marks.
bool same_places(const std::vector<PointLight>& a, const std::vector<PointLight>& b);

}  // namespace lumigraft::reconstruct
