#pragma once
// Uploads the camera frame to the GPU.
#include <algorithm>
#include <array>
#include <memory>

#include "capture/camera/radiance.h"
#include "capture/frame.h"
#include "capture/session/session.h"
#include "relight/passes/screen/screen.h"

namespace lumigraft::relight {

class CameraUpload {
 public:
  explicit CameraUpload(const capture::ColorCamera& camera);

  void take(const capture::FrameSet& frame);  ///< keeps its pixel values
  void upload_rays(gpu::Device& device, const Screen& screen);
  /// Uploads pixel values and depth, and radiance on request.
  void upload(gpu::Device& device, const capture::FrameSet& frame, bool with_radiance, const Screen& screen) const;

  /// Linear pixel value over radiance, (W/sr/m²)⁻¹ per channel.
  const Eigen::Array3f& exposure() const { return exposure_; }
  /// Part of the light that the lens transmits to a pixel, relative to the optical axis; radiance() is without it.
  float transmission(std::size_t pixel) const { return vignetting_ ? 1 / vignetting_->data[pixel] : 1; }
  const std::shared_ptr<const capture::Image<float>>& vignetting() const { return vignetting_; }
  capture::Image<float> radiance() const;             ///< computed anew
  Eigen::Array3f radiance(std::size_t pixel) const {  ///< of one
    if (picture_->encoded.empty()) return unencoded_radiance(pixel);
    const std::uint8_t* codes = &picture_->encoded.data[3 * pixel];
    const Eigen::Array3f light(radiance_of_[codes[0]][0], radiance_of_[codes[1]][1], radiance_of_[codes[2]][2]);
    return vignetting_ ? Eigen::Array3f(light * vignetting_->data[pixel]) : light;
  }
  /// Whether a channel is at the top of its range: radiance() is a lower bound. Without a channel: any.
  bool clipped(std::size_t pixel, std::size_t channel) const {
    return !picture_->encoded.empty() && picture_->encoded.data[3 * pixel + channel] >= capture::kFullScale;
  }
  bool clipped(std::size_t pixel) const { return clipped(pixel, 0) || clipped(pixel, 1) || clipped(pixel, 2); }
  bool any_clipped() const {
    return std::any_of(picture_->encoded.data.begin(), picture_->encoded.data.end(),
                       [](std::uint8_t value) { return value >= capture::kFullScale; });
  }
  /// Whether coded() has the exact radiance of pixels in which no channel clips: it is the camera's.
  bool coded_exactly() const { return response_is_srgb_ && !picture_->encoded.empty(); }
  const std::vector<float>& rays() const { return rays_; }  ///< x/z and y/z of every pixel
  /// The picture as sRGB codes; the camera's own picture where its codes are.
  const std::shared_ptr<const capture::Image<std::uint8_t>>& coded() const { return coded_; }

 private:
  Eigen::Array3f unencoded_radiance(std::size_t pixel) const;

  capture::ColorCamera camera_;
  bool response_is_srgb_ = false;
  Eigen::Array3f gain_ = Eigen::Array3f::Ones(), exposure_ = Eigen::Array3f::Ones();
  std::array<Eigen::Array3f, 256> radiance_of_;  ///< by code value and channel
  std::shared_ptr<const capture::Image<std::uint8_t>> coded_;
  std::shared_ptr<const capture::Frame> picture_;
  std::shared_ptr<const capture::Image<float>> vignetting_;  ///< FrameSet::color_vignetting
  std::vector<float> rays_;
};

}  // namespace lumigraft::relight
