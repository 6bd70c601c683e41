#include "relight/compose/foreground_matte.h"

#include <algorithm>
#include <memory>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "relight/compose/outline_matte.h"
#include "relight/compose/parameters.h"
#include "relight/compose/rgb_image.h"
#include "relight/tracing/parallel_for.h"

namespace lumigraft::relight {
namespace {

/// Bounds of the pixels that have an object, in the image.
cv::Rect bounds_of(const ObjectLayer& objects) {
  const capture::Image<float>& distance_m = objects.distance_m;
  int left = distance_m.width, right = -1, top = distance_m.height, bottom = -1;
  for (int y = 0; y < distance_m.height; ++y) {
    const float* row = &distance_m.data[distance_m.index(0, y)];
    const auto any = [](float m) { return m > 0; };
    const auto first = static_cast<int>(std::find_if(row, row + distance_m.width, any) - row);
    if (first == distance_m.width) continue;
    int last = distance_m.width - 1;
    while (!any(row[last])) --last;
    left = std::min(left, first);
    right = std::max(right, last);
    top = std::min(top, y);
    bottom = y;
  }
  return right < 0 ? cv::Rect() : cv::Rect(left + objects.left, top + objects.top, right + 1 - left, bottom + 1 - top);
}

/// The surfaces in front of the objects in a window around these.
class Foreground {
 public:
  /// `bounds`: of the objects, not empty.
  Foreground(const CurrentDepth& depth, const CameraUpload& picture, const ObjectLayer& objects, const cv::Rect& bounds)
      : depth_{depth}, objects_(objects), bounds_(bounds), reach_(picture.coded()->width) {
    const cv::Size size(picture.coded()->width, picture.coded()->height);
    const int margin = reach_.samples_px;
    window_ = cv::Rect(bounds.x - margin, bounds.y - margin, bounds.width + 2 * margin, bounds.height + 2 * margin) &
              cv::Rect({}, size);
    if (!find()) return;
    depth_.by = outline_displacement(*picture.coded(), window_.tl(), front_);
    if (depth_.by != cv::Point() && !find()) return;
    matte_.emplace(depth_, picture, window_.tl(), front_);
  }

  bool any() const { return matte_.has_value(); }
  /// Whether pixel (u, v) of the image is within reach of a surface in front of the objects.
  bool concerns(int u, int v) const {
    return from_core_(v - window_.y, u - window_.x) <=
           static_cast<float>(depth_.at(u, v) > 0 ? reach_.matte_px : reach_.samples_px);
  }
  OutlineMatte::Mixture at(int u, int v) const { return matte_->at(u, v); }

 private:
  /// Sets `front_` and `from_core_`. False: nothing is in front.
  bool find() {
    front_ = cv::Mat1b(window_.size(), std::uint8_t{0});
    cv::Mat1b core(window_.size(), std::uint8_t{0});  // in front of an object, at its pixels
    bool any = false;
    for (int v = bounds_.y; v < bounds_.y + bounds_.height; ++v) {
      for (int u = bounds_.x; u < bounds_.x + bounds_.width; ++u) {
        const float object_m = objects_.distance_m.at(u - objects_.left, v - objects_.top);
        if (!(object_m > 0)) continue;
        const float depth_m = depth_.at(u, v);
        if (!(depth_m > 0) || depth_m >= object_m - depth_.depth.allowed_m(depth_m)) continue;
        core(v - window_.y, u - window_.x) = 255;
        any = true;
      }
    }
    if (!any) return false;
    // Pixels without an object belong to the foreground if their depth continues that of the nearest core pixel.
    cv::Mat1i nearest;
    cv::distanceTransform(~core, from_core_, nearest, cv::DIST_L2, cv::DIST_MASK_5, cv::DIST_LABEL_PIXEL);
    std::vector<float> core_m(static_cast<std::size_t>(front_.total()) + 1);
    for (int y = 0; y < front_.rows; ++y) {
      for (int x = 0; x < front_.cols; ++x) {
        if (core(y, x)) core_m[static_cast<std::size_t>(nearest(y, x))] = depth_.at(x + window_.x, y + window_.y);
      }
    }
    for (int y = 0; y < front_.rows; ++y) {
      for (int x = 0; x < front_.cols; ++x) {
        const float depth_m = depth_.at(x + window_.x, y + window_.y),
                    near_m = core_m[static_cast<std::size_t>(nearest(y, x))];
        const int u = x + window_.x - objects_.left, v = y + window_.y - objects_.top;
        const bool inside = u >= 0 && v >= 0 && u < objects_.coverage.width && v < objects_.coverage.height;
        const bool on_object = inside && objects_.distance_m.at(u, v) > 0;
        const bool continues = !on_object && depth_m > 0 && depth_m < near_m * (1 + kCompose.moved_jump);
        front_(y, x) = core(y, x) || continues ? 255 : 0;
      }
    }
    // Pixels without depth are of the side that most pixels around them are of.
    cv::Mat1b majority;
    cv::medianBlur(front_, majority, 5);
    for (int y = 0; y < front_.rows; ++y) {
      for (int x = 0; x < front_.cols; ++x) {
        if (!(depth_.at(x + window_.x, y + window_.y) > 0)) front_(y, x) = majority(y, x);
      }
    }
    return true;
  }

  DisplacedDepth depth_;
  const ObjectLayer& objects_;
  cv::Rect bounds_, window_;
  MatteReach reach_;
  cv::Mat1b front_;      ///< nearer than the objects
  cv::Mat1f from_core_;  ///< distances in pixels from what is in front of an object
  std::optional<OutlineMatte> matte_;
};

/// Null if nothing is in front.
std::unique_ptr<const Foreground> foreground_of(const CurrentDepth& depth, const CameraUpload& picture,
                                                const ObjectLayer& objects) {
  const cv::Rect bounds = depth.any() ? bounds_of(objects) : cv::Rect();
  if (bounds.empty()) return nullptr;
  auto foreground = std::make_unique<const Foreground>(depth, picture, objects, bounds);
  return foreground->any() ? std::move(foreground) : nullptr;
}

void hide(const Foreground& front, ObjectLayer& objects) {
  for_each_pixel(objects.coverage.width, objects.coverage.height, kRows, [&](int x, int y) {
    const int u = x + objects.left, v = y + objects.top;
    float& coverage = objects.coverage.at(x, y);
    if (!(coverage > 0) || !(objects.distance_m.at(x, y) > 0) || !front.concerns(u, v)) return;
    const OutlineMatte::Mixture mixture = front.at(u, v);
    const float kept = 1 - mixture.foreground;
    const std::size_t i = objects.coverage.index(x, y);
    coverage *= kept;
    // (1 - coverage) C + coverage (C - B) = C - coverage B: removes the background's part of the mixture.
    set_at(objects.radiance, i, kept * radiance_at(objects.radiance, i) + coverage * (mixture.own - mixture.behind));
  });
}

}  // namespace

void hide_behind_foreground(const CurrentDepth& depth, const CameraUpload& picture, ObjectLayer& objects) {
  if (const auto front = foreground_of(depth, picture, objects)) hide(*front, objects);
}

std::optional<ObjectLayer> behind_foreground(const CurrentDepth& depth, const CameraUpload& picture,
                                             const ObjectLayer& objects) {
  const auto front = foreground_of(depth, picture, objects);
  if (!front) return std::nullopt;
  ObjectLayer hidden = objects;
  hide(*front, hidden);
  return hidden;
}

}  // namespace lumigraft::relight
