#pragma once
// Converts a session's truth/ into the ReferenceScene of the path tracer.
//
// Triangles and vertex colours come from real_scene.ply. Where a frame's camera sees the surface, its albedo.exr,
// f0.exr and roughness.exr take precedence. Triangles on a [[real_surface]] of the session have its material
// everywhere. Other surfaces outside every camera's view are Lambertian: truth/ does not describe metal there, so it
// reflects diffusely instead of as a mirror.
#include <filesystem>
#include <memory>
#include <vector>

#include "capture/frame.h"
#include "capture/session/session.h"
#include "relight/tracing/trace_scene.h"

namespace lumigraft::server {

class TrueRoom {
 public:
  /// Throws InputError where truth/ lacks what frame 0 needs.
  explicit TrueRoom(const capture::Session& session);

  /// Without objects. Frames that share a truth folder get the same pointer. Throws InputError.
  std::shared_ptr<const relight::ReferenceScene> at(const capture::FrameSet& frame);

 private:
  void take(const std::filesystem::path& folder);

  capture::Session session_;
  std::vector<relight::ReferenceMesh> meshes_;
  std::filesystem::path folder_;  ///< of `scene_`
  std::shared_ptr<const relight::ReferenceScene> scene_;
};

}  // namespace lumigraft::server
