#pragma once
// Light from far away as a session's truth has it.
#include <optional>
#include <vector>

#include "capture/camera/radiance.h"
#include "capture/session/session.h"
#include "reconstruct/light/light.h"
#include "server/truth/true_surface.h"

namespace lumigraft::server {

class TrueEnvironment {
 public:
  /// truth/environment.exr, and what of truth/real_scene.ply, if there is one, stands before it. The session has a
  /// fish-eye. Throws InputError.
  explicit TrueEnvironment(const capture::Session& session);

  /// Puts the environment into those pixels of a fish-eye picture that are lower bounds and see it: a sun is too strong
  /// for cameras, and for half-precision files.
  void complete(capture::RadiancePicture& picture) const;

  /// What the light stage makes lamps of in the environment, seen all around by a fish-eye that is as sharp as the
  /// session's.
  const std::vector<reconstruct::PointLight>& lamps() const { return lamps_; }

 private:
  Eigen::Vector3f mean_over_pixel(const capture::FisheyeCamera& camera, int u, int v) const;

  capture::FisheyeCamera fisheye_;
  reconstruct::EnvironmentMap environment_;
  std::optional<TrueSurface> room_;
  std::vector<reconstruct::PointLight> lamps_;
};

}  // namespace lumigraft::server
