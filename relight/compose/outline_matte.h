#pragma once
// Alpha of pixels at the outline of a foreground that depth shows: C = α F + (1 - α) B (Chuang et al. 2001), as in
// foreground_matte.h.
#include <opencv2/core.hpp>

#include "relight/compose/outline_lag.h"
#include "relight/compose/rgb_image.h"
#include "relight/passes/screen/camera_upload.h"

namespace lumigraft::relight {

/// How far pixels around objects are needed, and from how far their colours are taken, for an image of this width.
struct MatteReach {
  explicit MatteReach(int width);
  float sigma_px;  ///< of an outline's place in depth
  int matte_px, samples_px;
};

class OutlineMatte {
 public:
  /// `front`: not 0 in the foreground, of the window of the image at `corner`.
  OutlineMatte(const DisplacedDepth& depth, const CameraUpload& picture, const cv::Point& corner,
               const cv::Mat1b& front);

  /// Whether pixel (u, v) of the image, within the window, is near enough to the outline to be a mixture.
  bool reaches(int u, int v) const;

  struct Mixture {
    float foreground;        ///< α
    Rgb own, front, behind;  ///< the colours of the pixel, of the foreground, and of what is behind it
    bool both = false;       ///< both sides are near; else α is that of depth, and the colours are the pixel's
    bool in_front = false;   ///< depth shows the foreground at the pixel
    Rgb values_front = Rgb::Zero(), values_behind = Rgb::Zero();  ///< means of `values` on both sides, if both are near
  };
  /// `values`: of the image's size, three channels; null: none.
  Mixture at(int u, int v, const capture::Image<float>* values = nullptr) const;

 private:
  Rgb color(int u, int v) const { return picture_.radiance(static_cast<std::size_t>(v * width_ + u)); }
  /// Distance from the outline in depth: negative in the foreground.
  float signed_px(int x, int y) const { return front_(y, x) ? 0.5f - inside_(y, x) : outside_(y, x) - 0.5f; }

  DisplacedDepth depth_;
  const CameraUpload& picture_;
  int width_;  ///< of the image
  MatteReach reach_;
  cv::Point corner_;
  cv::Mat1b front_;
  cv::Mat1f inside_, outside_;  ///< distances in pixels: from what is not front, from front
};

}  // namespace lumigraft::relight
