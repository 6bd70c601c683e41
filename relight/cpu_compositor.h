#pragma once
// Composites the live frame on the CPU: the camera's pixel values, multiplied by a gain where the light on real
// surfaces changes, behind the objects. A frame in which only the camera's pixel values changed needs no GPU work; what
// this frame's depth shows in front of the objects is cut out of them here.
#include <cstdint>
#include <optional>
#include <vector>

#include "capture/image.h"
#include "relight/compose/current_depth.h"
#include "relight/compose/motion_blur.h"
#include "relight/compose/object_layer.h"
#include "relight/gpu/device.h"
#include "relight/passes/screen/camera_upload.h"
#include "relight/passes/screen/screen.h"

namespace lumigraft::relight {

class CpuCompositor {
 public:
  /// Reads back the results of LiveView for those blocks that screen.tiles selected among `considered`; other blocks
  /// keep their values.
  void read(gpu::Device& device, const Screen& screen, const CameraUpload& camera, const std::vector<char>& considered);
  /// Over the picture of `camera`. Of the objects: `motion`, and 1σ of the camera's blur.
  capture::Image<std::uint8_t> over(const CameraUpload& camera, const CurrentDepth& depth, const MotionBlur& motion,
                                    float blur_px);
  const ObjectLayer& objects() const { return objects_; }  ///< sharp, without what is in front of them
  /// As over() drew them last.
  const ObjectLayer& shown() const { return hidden_ ? *hidden_ : soft_ ? *soft_ : objects_; }

 private:
  enum class Kind : char { untouched, smooth, real, object };
  void spread_fine(int left, int top);
  void over_smooth(int left, int top, capture::Image<std::uint8_t>* picture) const;
  void over_real(int left, int top, capture::Image<std::uint8_t>* picture) const;
  void over_object(int left, int top, const CameraUpload& camera, const ObjectLayer& objects,
                   capture::Image<std::uint8_t>* picture) const;
  void over_outlines(const CameraUpload& camera, const ObjectLayer& objects,
                     capture::Image<std::uint8_t>* picture) const;
  Kind kind_at(int u, int v) const { return kinds_[static_cast<std::size_t>(v / kTile_px * columns_ + u / kTile_px)]; }

  int width_ = 0, height_ = 0, columns_ = 0, fine_step_ = 1;
  std::vector<Kind> kinds_;          ///< per block
  std::vector<float> smooth_;        ///< gain^(1/2.4), one value per smooth_px × smooth_px pixels
  std::vector<float> fine_;          ///< gain, one value per fine_step_ × fine_step_ pixels
  std::vector<float> gain_;          ///< per pixel, interpolated from these
  ObjectLayer objects_;              ///< of the picture's size
  std::optional<ObjectLayer> soft_;  ///< the same with a blur of soft_px_ and, if `moving_`, that of their motion
  float soft_px_ = 0;
  bool moving_ = false;
  std::optional<ObjectLayer> hidden_;  ///< behind something
};

}  // namespace lumigraft::relight
