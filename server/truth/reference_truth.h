#pragma once
// The true room of a session for the path-traced reference: truth/ as a ReferenceScene.
//
// Triangles and their colours are those of real_scene.ply. It has one colour a vertex, so what a frame's albedo.exr,
// f0.exr and roughness.exr show counts before that wherever their camera sees the surface. Triangles that lie on a
// [[real_surface]] of the session have its material everywhere. Anything else that no camera sees is taken as Lambert:
// metal there, which nothing in truth/ tells of, reflects light evenly and not as a mirror does.
#include <memory>

#include "capture/frame.h"
#include "capture/session/session.h"
#include "relight/tracing/trace_scene.h"

namespace lumigraft::server {

class TrueRoom {
 public:
  /// Throws InputError where truth/ lacks what frame 0 needs.
  explicit TrueRoom(const capture::Session& session);
  ~TrueRoom();

  /// Without objects. The same pointer for frames that share a truth folder. Throws InputError.
  std::shared_ptr<const relight::ReferenceScene> at(const capture::FrameSet& frame);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace lumigraft::server
