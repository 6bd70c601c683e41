#include "reconstruct/room/frozen_depth.h"

#include <cmath>
#include <opencv2/imgproc.hpp>

#include "reconstruct/math/median.h"
#include "reconstruct/room/parameters.h"

namespace lumigraft::reconstruct {
namespace {

constexpr const RoomParameters::FrozenDepth& kFrozen = kRoomParameters.frozen_depth;

template <typename Value>
cv::Mat_<cv::Vec<Value, 3>> matrix_of(const capture::Image<Value>& image) {
  using Pixel = cv::Vec<Value, 3>;
  return {image.height, image.width, reinterpret_cast<Pixel*>(const_cast<Value*>(image.data.data()))};
}
cv::Mat1f matrix_of_luminance(const capture::Image<float>& image) {
  return {image.height, image.width, const_cast<float*>(image.data.data())};
}

/// Green at half the resolution; pixel values, or the root of radiance.
capture::Image<float> half_size(const capture::Frame& picture) {
  const bool coded = !picture.encoded.empty();
  cv::Mat1f green;
  if (coded) {
    cv::Mat1b codes;
    cv::extractChannel(matrix_of(picture.encoded), codes, 1);
    codes.convertTo(green, CV_32F);
  } else {
    cv::extractChannel(matrix_of(picture.radiance), green, 1);
    cv::sqrt(cv::max(green, 0.0f), green);
  }
  capture::Image<float> half(green.cols / 2, green.rows / 2, 1);
  cv::Mat1f to = matrix_of_luminance(half);
  cv::resize(green, to, to.size(), 0, 0, cv::INTER_AREA);
  return half;
}

/// Whether most parts of the picture that have texture show another one: the camera moved, and not only a hand or a
/// tag. Light that changes leaves the texture.
bool moved(const capture::Image<float>& picture_before, const capture::Image<float>& picture_now) {
  const cv::Mat1f before = matrix_of_luminance(picture_before), now = matrix_of_luminance(picture_now);
  if (before.size() != now.size()) return true;
  std::vector<float> of_parts;
  for (int part = 0; part < kFrozen.columns * kFrozen.rows; ++part) {
    const int left = part % kFrozen.columns * now.cols / kFrozen.columns,
              right = (part % kFrozen.columns + 1) * now.cols / kFrozen.columns,
              top = part / kFrozen.columns * now.rows / kFrozen.rows,
              bottom = (part / kFrozen.columns + 1) * now.rows / kFrozen.rows;
    std::vector<float> of_blocks;
    for (int v = top; v + kFrozen.block_px <= bottom; v += kFrozen.block_px) {
      for (int u = left; u + kFrozen.block_px <= right; u += kFrozen.block_px) {
        const cv::Rect block(u, v, kFrozen.block_px, kFrozen.block_px);
        cv::Scalar mean, sigma;
        cv::meanStdDev(before(block), mean, sigma);
        if (!(sigma[0] > kFrozen.min_contrast * mean[0])) continue;
        cv::Mat1f correlation;
        cv::matchTemplate(before(block), now(block), correlation, cv::TM_CCOEFF_NORMED);
        of_blocks.push_back(correlation(0, 0));
      }
    }
    if (!of_blocks.empty()) of_parts.push_back(median(of_blocks));
  }
  return of_parts.size() >= kFrozen.min_parts && median(of_parts) < kFrozen.min_correlation;
}

}  // namespace

capture::FrameSet FrozenDepth::check(const capture::FrameSet& frame) {
  capture::FrameSet checked = frame;
  if (!frame.depth || !frame.color) return checked;
  const capture::Image<float>& depth_m = frame.depth->depth_m;
  const bool equal = depth_ && depth_->depth_m.width == depth_m.width && depth_->depth_m.height == depth_m.height &&
                     depth_->depth_m.data == depth_m.data;
  if (!equal) {
    depth_ = frame.depth;
    seen_with_it_ = half_size(*frame.color);
    frozen_ = false;
    return checked;
  }
  // A slower depth camera's newest picture belongs to more than one colour frame.
  if (frame.depth->stamp.time_ns == depth_->stamp.time_ns) return checked;
  frozen_ = moved(seen_with_it_, half_size(*frame.color));
  if (frozen_) checked.depth = nullptr;
  return checked;
}

std::vector<std::string> FrozenDepth::warnings() const {
  if (!frozen_) return {};
  return {"depth: the camera repeats one picture while it moves; it is not used until the next"};
}

}  // namespace lumigraft::reconstruct
