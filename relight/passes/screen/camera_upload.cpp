#include "relight/passes/screen/camera_upload.h"

#include <algorithm>
#include <cmath>

#include "capture/camera/radiance.h"
#include "capture/camera/srgb.h"

namespace lumigraft::relight {
namespace {

bool is_srgb(const capture::Response& response) {
  for (int code = 0; code < 256; ++code) {
    for (int c = 0; c < 3; ++c) {
      const float truth = capture::srgb_table().linear[static_cast<std::size_t>(code)];
      if (std::abs(response.to_linear(static_cast<std::uint8_t>(code), c) - truth) > 1e-5f) return false;
    }
  }
  return true;
}

}  // namespace

CameraUpload::CameraUpload(const capture::ColorCamera& camera)
    : camera_(camera), response_is_srgb_(is_srgb(camera.response)) {}

void CameraUpload::take(const capture::FrameSet& frame) {
  const std::shared_ptr<const capture::Frame>& picture = frame.color;
  picture_ = picture;
  gain_ = Eigen::Array3f::Map(frame.color_gain.data());
  vignetting_ = frame.color_vignetting;
  const bool encoded = !picture->encoded.empty();
  exposure_ = static_cast<float>(encoded ? picture->exposure : camera_.exposure) * gain_;
  for (int code = 0; encoded && code < 256; ++code) {
    for (int c = 0; c < 3; ++c) {
      const double linear = camera_.response.to_linear(static_cast<std::uint8_t>(code), c);
      radiance_of_[static_cast<std::size_t>(code)][c] = static_cast<float>(linear / picture->exposure) / gain_[c];
    }
  }
  if (encoded && response_is_srgb_) {
    coded_ = {picture, &picture->encoded};
    return;
  }
  const capture::Image<float> linear = radiance();
  auto coded = std::make_shared<capture::Image<std::uint8_t>>(linear.width, linear.height, 3);
  for (std::size_t i = 0; i < coded->data.size(); ++i) {
    coded->data[i] =
        capture::srgb_table().code(exposure_[static_cast<Eigen::Index>(i % 3)] * transmission(i / 3) * linear.data[i]);
  }
  coded_ = std::move(coded);
}

capture::Image<float> CameraUpload::radiance() const {
  capture::RadianceImage image = capture::to_radiance(*picture_, camera_.response);
  if (vignetting_) capture::undo_vignetting(image, *vignetting_);
  capture::Image<float>& result = image.radiance;
  if (!gain_.isOnes(0)) {
    for (std::size_t i = 0; i < result.data.size(); ++i) result.data[i] /= gain_[static_cast<Eigen::Index>(i % 3)];
  }
  return std::move(result);
}

Eigen::Array3f CameraUpload::unencoded_radiance(std::size_t pixel) const {
  const float* of_pixel = &picture_->radiance.data[3 * pixel];
  Eigen::Array3f light(of_pixel[0], of_pixel[1], of_pixel[2]);
  for (float& value : light) value = std::isfinite(value) ? std::max(value, 0.0f) : 0;
  return light / (gain_ * transmission(pixel));
}

void CameraUpload::upload_rays(gpu::Device& device, const Screen& screen) {
  rays_.clear();
  rays_.reserve(2 * static_cast<std::size_t>(screen.width) * screen.height);
  for (int v = 0; v < screen.height; ++v) {
    for (int u = 0; u < screen.width; ++u) {
      const auto ray = camera_.model.unproject({u, v});
      rays_.push_back(ray ? static_cast<float>(ray->x() / ray->z()) : 0.0f);
      rays_.push_back(ray ? static_cast<float>(ray->y() / ray->z()) : 0.0f);
    }
  }
  device.upload(*screen.rays, 0, std::as_bytes(std::span(rays_)));
}

void CameraUpload::upload(gpu::Device& device, const capture::FrameSet& frame, bool with_radiance,
                          const Screen& screen) const {
  device.upload_rgb(*screen.codes, coded_->data);
  const std::size_t pixels = static_cast<std::size_t>(screen.width) * screen.height;
  if (with_radiance) {
    std::vector<float> linear(4 * pixels);
    for (std::size_t i = 0; i < pixels; ++i) {
      const Eigen::Array3f of_pixel = radiance(i);
      std::copy_n(of_pixel.data(), 3, &linear[4 * i]);
      linear[4 * i + 3] = transmission(i);
    }
    device.upload(*screen.radiance, 0, std::as_bytes(std::span(linear)));
  }
  const bool has_depth = frame.depth && frame.depth->depth_m.data.size() == pixels;
  const std::vector<float> none(has_depth ? 0 : pixels, 0.0f);
  device.upload(*screen.depth, 0, std::as_bytes(std::span(has_depth ? frame.depth->depth_m.data : none)));
}

}  // namespace lumigraft::relight
