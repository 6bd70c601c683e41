#pragma once
// What depends on the camera: draws the picture from what the light volumes hold, and shows again what still holds of
// the last one.
#include <vector>

#include "relight/amortized_light_update.h"
#include "relight/cpu_compositor.h"
#include "relight/passes/screen/ambient.h"
#include "relight/passes/screen/camera_upload.h"
#include "relight/passes/screen/compose.h"
#include "relight/passes/screen/lamp_shadows.h"
#include "relight/passes/screen/live_view.h"
#include "relight/passes/screen/object_view.h"
#include "relight/passes/screen/real_view.h"
#include "relight/passes/screen/reflect.h"
#include "relight/passes/screen/shade.h"
#include "relight/passes/screen/shadow.h"
#include "relight/passes/screen/trace.h"
#include "relight/passes/screen/upsample.h"
#include "relight/quality.h"
#include "relight/renderer.h"
#include "relight/static_view_cache.h"
#include "relight/upload/brick_pool.h"

namespace lumigraft::relight {

class CameraView {
 public:
  CameraView(gpu::Device& device, const capture::ColorCamera& camera);

  /// `glossy`: known real surfaces are there.
  void fit(const Plan& plan, bool glossy);
  CameraUpload& camera() { return camera_; }
  const CameraUpload& camera() const { return camera_; }
  /// The pose to draw with; see StaticViewCache.
  const Eigen::Isometry3d& hold(const Eigen::Isometry3d& T_tag_camera, double nearest_m, bool* moved) {
    return still_.hold(T_tag_camera, nearest_m, moved);
  }

  struct View {
    const shader::FrameParams& params;
    const std::vector<PlacedObject>& objects;
    const std::vector<StoredModel::Mesh>& known_surfaces;
    const std::vector<GlossyBounds>& glossy;  ///< of these
    const gpu::Texture& white;
    const Plan& plan;
    bool anew;       ///< the camera, the light or the objects are not as they were
    bool with_maps;  ///< those of the full view
    bool live;       ///< the light was made for the live view
  };
  struct Light {
    const AmortizedLightUpdate& rounds;
    const LampMaps& maps;
    const BrickPool& bricks;
  };
  /// Draws only blocks that are not as they were; the rest is multiplied as before.
  void show_live(const capture::FrameSet& frame, const View& view, const Light& light, const LampShadows& shadows,
                 RelitPicture* result);
  /// Draws everything, or composes alone where only the camera's code values are new, or nothing where not even these.
  /// What is recorded comes after what the list holds.
  void show_full(const capture::FrameSet& frame, const View& view, const Light& light, gpu::CommandList& list,
                 RelitPicture* result);

 private:
  void draw_full(gpu::CommandList& list, const View& view, const Light& light) const;
  void draw_live(gpu::CommandList& list, const View& view, const Light& light, const LampShadows& shadows,
                 bool objects_anew) const;
  void light_objects(gpu::CommandList& list, const shader::FrameParams& params, const Light& light) const;
  bool same_codes() const;
  const capture::Image<float>* depth_of(const capture::FrameSet& frame) const;
  void submit(gpu::CommandList& list, RelitPicture* result);
  void read_maps(RelitPicture* result);

  gpu::Device& device_;
  CameraUpload camera_;
  capture::CameraModel model_;
  std::unique_ptr<Screen> screen_;
  // Passes, in the order in which they run.
  ObjectView object_view_;
  RealView real_view_;
  Shadow shadow_;
  Trace trace_;
  Upsample upsample_;
  Reflect reflect_;
  Ambient ambient_;
  Shade shade_;
  Compose compose_;
  LiveView live_view_;
  // What is kept from frame to frame.
  StaticViewCache still_;
  enum class Shown { nothing, live, full };
  Shown shown_ = Shown::nothing;  ///< what the screen holds of the last frame that a next one may show again
  CpuCompositor live_picture_;
  std::shared_ptr<const capture::Image<std::uint8_t>> full_codes_;  ///< of the camera,
  std::vector<std::byte> full_drawn_;                               ///< and what became of it, RGBA
  float full_exposure_ = 0;
};

}  // namespace lumigraft::relight
