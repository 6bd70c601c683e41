#pragma once
// The camera-dependent part of a frame: renders it from the light volumes, and reuses what is still valid of the last
// frame.
#include <vector>

#include "relight/amortized_light_update.h"
#include "relight/compose/current_depth.h"
#include "relight/cpu_compositor.h"
#include "relight/look/camera_look.h"
#include "relight/passes/screen/camera_upload.h"
#include "relight/passes/screen/lamp_shadows.h"
#include "relight/passes/screen/layers.h"
#include "relight/passes/screen/live_view.h"
#include "relight/passes/screen/object_view.h"
#include "relight/passes/screen/real_change.h"
#include "relight/passes/screen/real_view.h"
#include "relight/quality.h"
#include "relight/renderer.h"
#include "relight/static_view_cache.h"
#include "relight/upload/brick_pool.h"

namespace lumigraft::relight {

class CameraView {
 public:
  CameraView(gpu::Device& device, const capture::ColorCamera& camera, const capture::DepthNoise& depth_noise = {});

  /// `glossy`: real surfaces of known material exist.
  void fit(const Plan& plan, int max_lamps, bool glossy);
  const CameraUpload& camera() const { return camera_; }
  const PixelRays& pixel_rays() const { return pixel_rays_; }
  /// A new frame. `like_camera`: objects get the camera's noise and sharpness (Plan::look).
  void take(const capture::FrameSet& frame, const reconstruct::Scene& scene, bool like_camera);
  /// The camera pose to render with; see StaticViewCache.
  const Eigen::Isometry3d& hold(const Eigen::Isometry3d& T_tag_camera, double nearest_m, bool* moved) {
    return still_.hold(T_tag_camera, nearest_m, moved);
  }

  struct View {
    const shader::FrameParams& params;
    const std::vector<PlacedObject>& objects;
    const std::vector<StoredModel::Mesh>& known_surfaces;
    const std::vector<GlossyBounds>& glossy;  ///< bounds of glossy real surfaces of known material
    const gpu::Texture& white;
    const Plan& plan;
    bool anew;                 ///< camera, light or objects changed since the last frame
    bool with_maps;            ///< also fill the maps of the full view (RelightMaps)
    bool live;                 ///< the light was computed for the live view
    const MotionBlur& motion;  ///< of objects, if they get the camera's look
  };
  struct Light {
    const AmortizedLightUpdate& rounds;
    const LampMaps& maps;
    const BrickPool& bricks;
  };
  /// Renders only the blocks that changed; the others reuse their factors.
  void show_live(const capture::FrameSet& frame, const View& view, const Light& light, const LampShadows& shadows,
                 RelitPicture* result);
  /// Renders everything; only composes if nothing but the camera's pixel values changed, or what is in front of the
  /// objects; does nothing if these are equal too. Appends its commands to the list.
  void show_full(const capture::FrameSet& frame, const View& view, const Light& light, gpu::CommandList& list,
                 RelitPicture* result);

 private:
  void draw_full(gpu::CommandList& list, const View& view, const Light& light) const;
  void draw_live(gpu::CommandList& list, const View& view, const Light& light, const LampShadows& shadows,
                 bool objects_anew) const;
  void light_objects(gpu::CommandList& list, const shader::FrameParams& params, const Light& light) const;
  bool same_codes() const;
  void submit(gpu::CommandList& list, RelitPicture* result);
  void read_layers();
  /// `objects`: without what is in front of them.
  void add_maps(const CurrentDepth& depth, const ObjectLayer& objects, RelitPicture* result);

  float blur_px() const { return like_camera_ ? look_.blur_px() : 0; }
  /// The camera's resolution in colour, and its noise.
  void give_look(const capture::FrameSet& frame, const ObjectLayer& objects,
                 capture::Image<std::uint8_t>* picture) const;

  gpu::Device& device_;
  CameraUpload camera_;
  CameraLook look_;
  bool like_camera_ = false;
  capture::CameraModel model_;
  PixelRays pixel_rays_;
  capture::DepthNoise depth_noise_;
  std::unique_ptr<Screen> screen_;
  // Passes in execution order.
  ObjectView object_view_;
  RealView real_view_;
  RealChange real_change_;
  Layers layers_;
  LiveView live_view_;
  // State kept between frames.
  StaticViewCache still_;
  enum class Shown { nothing, live, full };
  Shown shown_ = Shown::nothing;  ///< which results of the last frame on the screen can be reused
  CpuCompositor live_picture_;
  std::shared_ptr<const capture::Image<std::uint8_t>> full_codes_;  ///< of the camera,
  capture::Image<float> full_change_;                               ///< L_Δ of real pixels, 3 channels
  capture::Image<float> full_radiance_;   ///< of real pixels, clipped channels restored; empty: none clips
  ObjectLayer full_objects_, full_soft_;  ///< sharp, and as the camera sees them; without what is in front of them
  float full_blur_px_ = 0;
  bool full_moving_ = false;      ///< their own motion is part of that
  bool full_foreground_ = false;  ///< something was in front of them
  capture::Image<std::uint8_t> full_picture_;
  Eigen::Array3f full_exposure_ = Eigen::Array3f::Zero();
  std::shared_ptr<const capture::Image<float>> full_vignetting_;
};

}  // namespace lumigraft::relight
