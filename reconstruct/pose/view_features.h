#pragma once
// Points of an image that are found again from another place.
#include <Eigen/Core>
#include <cstdint>
#include <vector>

#include "capture/camera/camera_model.h"
#include "capture/frame.h"

namespace lumigraft::reconstruct {

/// ORB features (Rublee et al. 2011) of an image, and the image in small: blurred, with mean 0 and length 1, so that
/// the product of two is their correlation (Klein & Murray 2008, "Improving the agility of keyframe-based SLAM").
struct ViewFeatures {
  static constexpr int kDescriptorBytes = 32;
  std::vector<Eigen::Vector2f> pixels;       ///< sub-pixel
  std::vector<float> sigma_px;               ///< 1σ of their position: grows with the scale at which a point was found
  capture::Image<std::uint8_t> descriptors;  ///< a row for each point, kDescriptorBytes wide
  std::vector<float> small;

  std::size_t size() const { return pixels.size(); }
};

ViewFeatures features_of(const capture::Frame& color, const capture::CameraModel& camera);

/// Correlation of two small images, -1 to 1.
float similarity(const ViewFeatures& a, const ViewFeatures& b);

/// Of each point of `a` the point of `b`, or -1: the most similar descriptor, if it is clearly more similar than the
/// second and the reverse holds, too. `near_px`: if not empty, where points of `a` are expected in the image of `b`
/// (NaN: outside), up to `reach_px`.
std::vector<int> matched_points(const ViewFeatures& a, const ViewFeatures& b,
                                const std::vector<Eigen::Vector2f>& near_px = {}, float reach_px = 0);

}  // namespace lumigraft::reconstruct
