#pragma once
// The camera picture on its way to the GPU.
#include "capture/frame.h"
#include "capture/radiance.h"
#include "capture/session.h"
#include "relight/passes/screen.h"

namespace lumigraft {

class CameraUpload {
 public:
  explicit CameraUpload(const ColorCamera& camera);

  void take(const Picture& picture);  ///< keeps code values and radiance of this frame
  void upload_rays(gpu::Device& device, const Screen& screen);
  void upload(gpu::Device& device, const FrameSet& frame, const Screen& screen) const;

  float exposure() const { return exposure_; }
  bool codes_are_srgb() const { return codes_are_srgb_; }   ///< unchanged pixels may keep their code values
  const std::vector<float>& rays() const { return rays_; }  ///< x/z and y/z of every pixel
  const Image<float>& radiance() const { return radiance_; }
  const Image<std::uint8_t>& coded() const { return coded_; }  ///< the picture as sRGB codes

 private:
  ColorCamera camera_;
  bool response_is_srgb_ = false, codes_are_srgb_ = false;
  float exposure_ = 1;
  Image<std::uint8_t> coded_;
  Image<float> radiance_;
  std::vector<float> rays_;
};

}  // namespace lumigraft
