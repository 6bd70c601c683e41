#include "relight/compose/motion_blur.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "relight/compose/parameters.h"
#include "relight/compose/rgb_image.h"
#include "relight/tracing/parallel_for.h"

namespace lumigraft::relight {
namespace {

using Eigen::Vector2f;

/// What a pixel of the layer shows at a position between pixels; nothing beyond the window.
struct Sample {
  Rgb radiance = Rgb::Zero();
  float coverage = 0, distance_m = 0;  ///< the largest around
};

Sample sample_at(const ObjectLayer& objects, const Vector2f& at) {
  const auto left = static_cast<int>(std::floor(at.x())), top = static_cast<int>(std::floor(at.y()));
  const float right = at.x() - static_cast<float>(left), below = at.y() - static_cast<float>(top);
  Sample sum;
  for (int j = 0; j < 2; ++j) {
    for (int i = 0; i < 2; ++i) {
      const auto pixel = objects.index(left + i, top + j);
      const float weight = (i ? right : 1 - right) * (j ? below : 1 - below);
      if (!pixel || weight == 0) continue;
      sum.radiance += weight * radiance_at(objects.radiance, *pixel);
      sum.coverage += weight * objects.coverage.data[*pixel];
      sum.distance_m = std::max(sum.distance_m, objects.distance_m.data[*pixel]);
    }
  }
  return sum;
}

/// Of every pixel of the window `grown`, that of the nearest pixel of the layer with an object.
class NearestShift {
 public:
  NearestShift(const ObjectLayer& objects, const capture::Image<float>& shift_px, const cv::Rect& grown)
      : shift_px_(shift_px) {
    cv::Mat1b none(grown.size(), std::uint8_t{255});
    for (int y = 0; y < shift_px.height; ++y) {
      for (int x = 0; x < shift_px.width; ++x) {
        if (objects.distance_m.at(x, y) > 0) none(y + objects.top - grown.y, x + objects.left - grown.x) = 0;
      }
    }
    cv::Mat1f distance;
    cv::distanceTransform(none, distance, nearest_, cv::DIST_L2, cv::DIST_MASK_5, cv::DIST_LABEL_PIXEL);
    pixels_.resize(static_cast<std::size_t>(cv::countNonZero(none == 0)) + 1);
    for (int y = 0; y < shift_px.height; ++y) {
      for (int x = 0; x < shift_px.width; ++x) {
        const cv::Point at(x + objects.left - grown.x, y + objects.top - grown.y);
        if (none(at) == 0) pixels_[static_cast<std::size_t>(nearest_(at))] = {x, y};
      }
    }
  }
  Vector2f at(int x, int y) const {
    const cv::Point& from = pixels_[static_cast<std::size_t>(nearest_(y, x))];
    return {shift_px_.at(from.x, from.y, 0), shift_px_.at(from.x, from.y, 1)};
  }

 private:
  const capture::Image<float>& shift_px_;
  cv::Mat1i nearest_;              ///< label of a pixel with an object
  std::vector<cv::Point> pixels_;  ///< by label, in the layer's window
};

/// Half of the longest shift to each side, whole pixels.
cv::Size margin_of(const capture::Image<float>& shift_px) {
  float across = 0, down = 0;
  for (std::size_t i = 0; i < shift_px.data.size(); i += 2) {
    across = std::max(across, std::abs(shift_px.data[i]));
    down = std::max(down, std::abs(shift_px.data[i + 1]));
  }
  return {static_cast<int>(std::ceil(across / 2)), static_cast<int>(std::ceil(down / 2))};
}

}  // namespace

std::optional<Vector2f> ObjectMotion::shift_px(const PosedCamera& camera, const Eigen::Vector3f& at_m) const {
  const Eigen::Isometry3f T_camera_tag = camera.T_tag_camera.inverse();
  const auto from = camera.model.project((T_camera_tag * (to_begin * at_m)).cast<double>()),
             to = camera.model.project((T_camera_tag * (to_end * at_m)).cast<double>());
  if (!from || !to) return std::nullopt;
  const Vector2f shift = (*to - *from).cast<float>();
  return shift * std::min(1.0f, kCompose.max_motion_px / std::max(shift.norm(), 1.0f));
}

std::vector<ObjectMotion> motions_over(const Exhibit& exhibit, double time_s, double exposure_s) {
  std::vector<ObjectMotion> motions;
  for (const VirtualObject& object : exhibit.objects) {
    if (!object.drawn(time_s)) continue;
    ObjectMotion& motion = motions.emplace_back();
    if (object.motion.size() < 2) continue;
    const Eigen::Affine3d T_model_tag = object.T_tag_model(time_s).inverse();
    motion.to_begin = (object.T_tag_model(time_s - exposure_s / 2) * T_model_tag).cast<float>();
    motion.to_end = (object.T_tag_model(time_s + exposure_s / 2) * T_model_tag).cast<float>();
    motion.any = !motion.to_begin.isApprox(motion.to_end);
  }
  return motions;
}

// The gathering filter of McGuire et al. 2012 for one moving layer: objects that pass each other are blurred as one.
ObjectLayer motion_blurred(const ObjectLayer& objects, const capture::Image<float>& shift_px, int width, int height) {
  const cv::Size margin = margin_of(shift_px);
  const bool any_object = std::ranges::any_of(objects.distance_m.data, [](float m) { return m > 0; });
  if (!any_object || margin == cv::Size(0, 0)) return objects;
  const cv::Rect window =
      cv::Rect(objects.left - margin.width, objects.top - margin.height, objects.coverage.width + 2 * margin.width,
               objects.coverage.height + 2 * margin.height) &
      cv::Rect(0, 0, width, height);
  const NearestShift shifts(objects, shift_px, window);
  const capture::Image<float> empty(window.width, window.height, 1);
  ObjectLayer blurred{window.x, window.y, capture::Image<float>(window.width, window.height, 3), empty, empty};
  for_each_pixel(window.width, window.height, kRows, [&](int x, int y) {
    const Vector2f at(static_cast<float>(x + window.x), static_cast<float>(y + window.y)), shift = shifts.at(x, y);
    const int samples = 1 + static_cast<int>(std::ceil(kCompose.motion_samples_per_px * shift.norm()));
    Sample sum;
    for (int k = 0; k < samples; ++k) {
      const float along = (static_cast<float>(k) + 0.5f) / static_cast<float>(samples) - 0.5f;
      const Sample there = sample_at(objects, at - along * shift);
      sum.radiance += there.radiance;
      sum.coverage += there.coverage;
      sum.distance_m = std::max(sum.distance_m, there.distance_m);
    }
    const std::size_t i = blurred.coverage.index(x, y);
    set_at(blurred.radiance, i, sum.radiance / static_cast<float>(samples));
    blurred.coverage.data[i] = sum.coverage / static_cast<float>(samples);
    const auto own = objects.index(x + window.x, y + window.y);
    const float own_m = own ? objects.distance_m.data[*own] : 0;
    blurred.distance_m.data[i] = own_m > 0 ? own_m : sum.distance_m;
  });
  return blurred;
}

}  // namespace lumigraft::relight
