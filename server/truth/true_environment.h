#pragma once
// Distant light from a session's truth/.
#include <optional>
#include <vector>

#include "capture/camera/radiance.h"
#include "capture/session/session.h"
#include "reconstruct/light/light.h"
#include "server/truth/true_surface.h"

namespace lumigraft::server {

class TrueEnvironment {
 public:
  /// Loads truth/environment.exr and, if present, truth/real_scene.ply as its occluder. The session must have a
  /// fish-eye. Throws InputError.
  explicit TrueEnvironment(const capture::Session& session);

  /// Fills in the environment where fish-eye pixels are lower bounds and see it: the sun exceeds the range of cameras
  /// and of half-precision files.
  void complete(capture::RadianceImage& picture) const;

  /// Lamps that the light stage detects in the environment, rendered as an omnidirectional fish-eye with the session's
  /// angular resolution.
  const std::vector<reconstruct::PointLight>& lamps() const { return lamps_; }

 private:
  Eigen::Vector3f mean_over_pixel(const capture::FisheyeCamera& camera, int u, int v) const;

  capture::FisheyeCamera fisheye_;
  reconstruct::EnvironmentMap environment_;
  std::optional<TrueSurface> room_;
  std::vector<reconstruct::PointLight> lamps_;
};

}  // namespace lumigraft::server
