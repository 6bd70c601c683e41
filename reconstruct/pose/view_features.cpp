#include "reconstruct/pose/view_features.h"

#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <numeric>
#include <opencv2/features2d.hpp>
#include <opencv2/imgproc.hpp>

#include "reconstruct/pose/gray_regions.h"
#include "reconstruct/pose/parameters.h"

namespace lumigraft::reconstruct {
namespace {

std::vector<float> small_picture(const cv::Mat& grey) {
  cv::Mat small;
  cv::resize(grey, small, {kKeyframes.small_width, kKeyframes.small_height}, 0, 0, cv::INTER_AREA);
  small.convertTo(small, CV_32F);
  cv::GaussianBlur(small, small, {0, 0}, kKeyframes.small_blur_px);
  std::vector<float> result(small.begin<float>(), small.end<float>());
  const float mean = std::accumulate(result.begin(), result.end(), 0.0f) / static_cast<float>(result.size());
  float squares = 0;
  for (float& value : result) {
    value -= mean;
    squares += value * value;
  }
  const float scale = squares > 0 ? 1 / std::sqrt(squares) : 0;
  for (float& value : result) value *= scale;
  return result;
}

int hamming(const std::uint8_t* a, const std::uint8_t* b) {
  int bits = 0;
  for (int i = 0; i < ViewFeatures::kDescriptorBytes; i += 8) {
    std::uint64_t x, y;
    std::memcpy(&x, a + i, 8);
    std::memcpy(&y, b + i, 8);
    bits += std::popcount(x ^ y);
  }
  return bits;
}

/// The most similar descriptors of a point so far.
struct Nearest {
  int index = -1;
  int bits = std::numeric_limits<int>::max(), second_bits = std::numeric_limits<int>::max();

  void add(int candidate, int distance) {
    if (distance < bits) {
      second_bits = bits;
      bits = distance;
      index = candidate;
    } else if (distance < second_bits) {
      second_bits = distance;
    }
  }
  bool clear() const {
    return index >= 0 && bits <= kKeyframes.max_bits &&
           (second_bits == std::numeric_limits<int>::max() ||
            static_cast<float>(bits) < kKeyframes.max_ratio * static_cast<float>(second_bits));
  }
};

}  // namespace

ViewFeatures features_of(const capture::Frame& color, const capture::CameraModel& camera) {
  const capture::Image<std::uint8_t> codes = detector_codes(color, {0, 0, camera.width, camera.height},
                                                            color.radiance.empty() ? 1 : detector_gain(color.radiance));
  const cv::Mat grey(codes.height, codes.width, CV_8UC1, const_cast<std::uint8_t*>(codes.data.data()));
  std::vector<cv::KeyPoint> points;
  cv::Mat descriptors;
  cv::ORB::create(kKeyframes.features, kKeyframes.octave, kKeyframes.octaves, 31, 0, 2, cv::ORB::HARRIS_SCORE, 31,
                  kKeyframes.corner_threshold)
      ->detectAndCompute(grey, {}, points, descriptors);
  ViewFeatures result;
  result.descriptors = capture::Image<std::uint8_t>(ViewFeatures::kDescriptorBytes, static_cast<int>(points.size()), 1);
  for (std::size_t i = 0; i < points.size(); ++i) {
    result.pixels.emplace_back(points[i].pt.x, points[i].pt.y);
    result.sigma_px.push_back(kKeyframes.point_sigma_px *
                              std::pow(kKeyframes.octave, static_cast<float>(points[i].octave)));
    std::memcpy(&result.descriptors.at(0, static_cast<int>(i)), descriptors.ptr(static_cast<int>(i)),
                ViewFeatures::kDescriptorBytes);
  }
  result.small = small_picture(grey);
  return result;
}

float similarity(const ViewFeatures& a, const ViewFeatures& b) {
  return a.small.size() == b.small.size() ? std::inner_product(a.small.begin(), a.small.end(), b.small.begin(), 0.0f)
                                          : 0;
}

std::vector<int> matched_points(const ViewFeatures& a, const ViewFeatures& b,
                                const std::vector<Eigen::Vector2f>& near_px, float reach_px) {
  std::vector<Nearest> of_a(a.size()), of_b(b.size());
  for (std::size_t i = 0; i < a.size(); ++i)
    for (std::size_t j = 0; j < b.size(); ++j) {
      // Not a number is not within reach.
      if (!near_px.empty() && !((near_px[i] - b.pixels[j]).squaredNorm() < reach_px * reach_px)) continue;
      const int bits = hamming(&a.descriptors.data[i * ViewFeatures::kDescriptorBytes],
                               &b.descriptors.data[j * ViewFeatures::kDescriptorBytes]);
      of_a[i].add(static_cast<int>(j), bits);
      of_b[j].add(static_cast<int>(i), bits);
    }
  std::vector<int> result(a.size(), -1);
  for (std::size_t i = 0; i < a.size(); ++i)
    if (of_a[i].clear() && of_b[of_a[i].index].index == static_cast<int>(i)) result[i] = of_a[i].index;
  return result;
}

}  // namespace lumigraft::reconstruct
