#include "relight/compose/soften.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

namespace lumigraft::relight {
namespace {

/// The smallest window of pixels that show objects.
cv::Rect covered_part(const capture::Image<float>& coverage) {
  const cv::Mat1f mat(coverage.height, coverage.width, const_cast<float*>(coverage.data.data()));
  return cv::boundingRect(cv::Mat1b(mat > 0));
}

/// The image's own memory.
template <int kChannels>
cv::Mat_<cv::Vec<float, kChannels>> mat_of(const capture::Image<float>& image) {
  using Pixel = cv::Vec<float, kChannels>;
  return {image.height, image.width, reinterpret_cast<Pixel*>(const_cast<float*>(image.data.data()))};
}

/// An image of this size, zero except for `inner`, which is the `part` of `image`.
template <int kChannels>
capture::Image<float> with_margin(const capture::Image<float>& image, const cv::Rect& part, const cv::Rect& inner,
                                  const cv::Size& size) {
  capture::Image<float> grown(size.width, size.height, kChannels);
  mat_of<kChannels>(image)(part).copyTo(mat_of<kChannels>(grown)(inner));
  return grown;
}

/// Discrete Gaussian of variance `sigma_px`² (Lindeberg 1990, eq. 10): a sampled one is too narrow below 0.6 px.
cv::Mat1f discrete_gaussian(float sigma_px, int margin) {
  cv::Mat1f kernel(2 * margin + 1, 1);
  const double t = static_cast<double>(sigma_px) * sigma_px;
  for (int n = -margin; n <= margin; ++n)
    kernel(n + margin) = static_cast<float>(std::exp(-t) * std::cyl_bessel_i(std::abs(n), t));
  return kernel / cv::sum(kernel)[0];
}

}  // namespace

ObjectLayer softened(const ObjectLayer& objects, float sigma_px, int width, int height) {
  if (objects.coverage.empty() || !(sigma_px > 0)) return objects;
  const int margin = static_cast<int>(std::ceil(3 * sigma_px));
  const cv::Rect part = covered_part(objects.coverage);
  if (part.empty()) return {};
  const cv::Rect old = part + cv::Point(objects.left, objects.top);
  const cv::Rect window = cv::Rect(old.x - margin, old.y - margin, old.width + 2 * margin, old.height + 2 * margin) &
                          cv::Rect(0, 0, width, height);
  const cv::Rect inner = old - window.tl();
  const cv::Mat1f kernel = discrete_gaussian(sigma_px, margin);
  ObjectLayer soft{window.x, window.y, with_margin<3>(objects.radiance, part, inner, window.size()),
                   with_margin<1>(objects.coverage, part, inner, window.size()),
                   capture::Image<float>(window.width, window.height, 1)};
  const auto blur = [&](auto mat) {
    // Beyond the image's border the object continues.
    cv::sepFilter2D(mat, mat, -1, kernel, kernel, {-1, -1}, 0, cv::BORDER_REPLICATE);
  };
  blur(mat_of<3>(soft.radiance));
  blur(mat_of<1>(soft.coverage));
  const capture::Image<float> distance_m = with_margin<1>(objects.distance_m, part, inner, window.size());
  const auto distance = mat_of<1>(distance_m), around = mat_of<1>(soft.distance_m);
  cv::dilate(distance, around, cv::getStructuringElement(cv::MORPH_RECT, {2 * margin + 1, 2 * margin + 1}));
  distance.copyTo(around, distance > 0);
  return soft;
}

}  // namespace lumigraft::relight
