#include "relight/compose/foreground_matte.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <opencv2/imgproc.hpp>
#include <vector>

#include "relight/compose/outline_matte.h"
#include "relight/compose/parameters.h"
#include "relight/compose/rgb_image.h"
#include "relight/tracing/parallel_for.h"

namespace lumigraft::relight {
namespace {

constexpr int kMatteBlock = 256;  // pixels per thread at a time

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

cv::Rect grown(const cv::Rect& bounds, int by_px) {
  return {bounds.x - by_px, bounds.y - by_px, bounds.width + 2 * by_px, bounds.height + 2 * by_px};
}

/// Pixels that are in front of an object, and what is near them. They are looked for in squares of `edge_px`: depth
/// shows an outline no better.
class Core {
 public:
  Core(const DisplacedDepth& depth, const std::vector<cv::Point>& pixels, const cv::Rect& window, int edge_px)
      : edge_px_(edge_px) {
    cv::Mat1b others((window.height - 1) / edge_px + 1, (window.width - 1) / edge_px + 1, std::uint8_t{255});
    const auto square_of = [&](const cv::Point& pixel) {
      return cv::Point((pixel.x - window.x) / edge_px, (pixel.y - window.y) / edge_px);
    };
    for (const cv::Point& pixel : pixels) others(square_of(pixel)) = 0;
    cv::distanceTransform(others, from_squares_, nearest_, cv::DIST_L2, cv::DIST_MASK_5, cv::DIST_LABEL_PIXEL);
    depth_m_.resize(pixels.size() + 1);
    for (const cv::Point& pixel : pixels) {
      float& depth_m = depth_m_[static_cast<std::size_t>(nearest_(square_of(pixel)))];
      depth_m = std::max(depth_m, depth.at(pixel.x, pixel.y));
    }
  }

  /// Calls act(x, px) for the pixels in row y of the window, of this width, that are within this distance of the core.
  /// Where squares are larger than pixels `px` is a bound of a pixel's distance from below.
  template <typename Act>
  void for_each_within(float reach_px, int y, int width, Act act) const {
    constexpr float kDiagonal = 1.5f;  // of a square, over its edge
    const auto edge = static_cast<float>(edge_px_);
    const float* squares = from_squares_[y / edge_px_];
    for (int column = 0; column < from_squares_.cols; ++column) {
      const float px = edge * squares[column] - kDiagonal * (edge - 1);
      if (px > reach_px) continue;
      for (int x = column * edge_px_; x < std::min((column + 1) * edge_px_, width); ++x) act(x, px);
    }
  }
  /// Of the core near a pixel.
  float nearest_m(int x, int y) const {
    return depth_m_[static_cast<std::size_t>(nearest_(y / edge_px_, x / edge_px_))];
  }
  float farthest_m() const { return *std::max_element(depth_m_.begin(), depth_m_.end()); }

 private:
  int edge_px_;
  cv::Mat1f from_squares_;
  cv::Mat1i nearest_;           ///< label of a square with core
  std::vector<float> depth_m_;  ///< by label
};

/// The surfaces in front of the objects in a window around what they hide.
class Foreground {
 public:
  /// `bounds`: of the objects, not empty.
  Foreground(const CurrentDepth& depth, const CameraUpload& picture, const ObjectLayer& objects, const cv::Rect& bounds)
      : depth_{depth}, picture_(picture), objects_(objects), bounds_(bounds), reach_(picture.coded()->width) {
    if (!find()) return;
    depth_.by = outline_displacement(*picture.coded(), window_.tl(), *away_);
    if (depth_.by != cv::Point() && !find()) return;
    matte_.emplace(depth_, picture, window_.tl(), *away_);
    pixels_ = found_in_rows<cv::Point>(window_.height, [&](int y, std::vector<cv::Point>& found) {
      core_->for_each_within(static_cast<float>(reach_.samples_px), y, window_.width, [&](int x, float from_core_px) {
        const int u = x + window_.x, v = y + window_.y;
        const auto i = objects_.index(u, v);
        if (!i || !(objects_.coverage.data[*i] > 0) || !(objects_.distance_m.data[*i] > 0)) return;
        if (from_core_px <= static_cast<float>(reach_.matte_px) || !depth_.known(u, v)) found.emplace_back(u, v);
      });
    });
    matte_->prepare(pixels_);
  }

  bool any() const { return matte_.has_value(); }
  /// Those of objects that are within reach of a surface in front of them.
  const std::vector<cv::Point>& pixels() const { return pixels_; }
  OutlineMatte::Reader mixtures() const { return OutlineMatte::Reader(*matte_); }
  /// Whether the pixel is no mixture but inside of what is in front.
  bool hides(const cv::Point& pixel) const { return matte_->is_front(pixel.x, pixel.y); }

 private:
  /// Finds what is in front, and the outline's distances. False: nothing is.
  bool find() {
    const cv::Size size(picture_.coded()->width, picture_.coded()->height);
    // In front of an object, at its pixels.
    const std::vector<cv::Point> core =
        found_in_rows<cv::Point>(bounds_.height, [&](int y, std::vector<cv::Point>& found) {
          const int v = y + bounds_.y;
          const float* row_m = &objects_.distance_m.at(bounds_.x - objects_.left, v - objects_.top);
          const int end = bounds_.x + bounds_.width;
          for (int u = bounds_.x; u < end; ++u) {
            const int next = u + DisplacedDepth::kLanes;
            if (next <= end && !depth_.any_nearer(u, v, reconstruct::load(row_m + u - bounds_.x))) {
              u = next - 1;
              continue;
            }
            const float object_m = row_m[u - bounds_.x];
            if (!(object_m > 0) || !depth_.maybe_nearer(u, v, object_m)) continue;
            const float depth_m = depth_.at(u, v);
            if (depth_m < object_m - depth_.depth.allowed_m(depth_m)) found.emplace_back(u, v);
          }
        });
    if (core.empty()) return false;
    const cv::Rect hiding = cv::boundingRect(core);
    // Pixels up to samples_px away are mixtures, with colours from as far again.
    window_ = grown(hiding, 2 * reach_.samples_px) & grown(bounds_, reach_.samples_px) & cv::Rect({}, size);
    mark_front(core);
    away_.emplace(front_, std::max(reach_.samples_px, lag_distance_px(size.width)));
    return true;
  }
  void mark_front(const std::vector<cv::Point>& core) {
    // Pixels without an object belong to the foreground if their depth continues that of the nearest core pixel.
    core_.emplace(depth_, core, window_, std::max(static_cast<int>(std::lround(reach_.sigma_px)), 1));
    const float farthest_m = core_->farthest_m() * (1 + kCompose.moved_jump);
    front_ = cv::Mat1b(window_.size(), std::uint8_t{0});
    const cv::Mat1f along_z_m = depth_.within(window_);
    for_each_index(window_.height, kRows, [&](int y) {
      const float* z_m = along_z_m[y];
      for (int x = 0; x < window_.width; ++x) {
        if (!(z_m[x] > 0) || z_m[x] >= farthest_m) continue;
        const int u = x + window_.x, v = y + window_.y;
        const auto i = objects_.index(u, v);
        const bool on_object = i && objects_.distance_m.data[*i] > 0;
        if (!on_object && depth_.nearer(u, v, core_->nearest_m(x, y) * (1 + kCompose.moved_jump))) front_(y, x) = 255;
      }
    });
    for (const cv::Point& pixel : core) front_(pixel - window_.tl()) = 255;
    // Pixels without depth are of the side that most pixels around them are of.
    constexpr int kAround = 5;
    cv::Mat1b in_front;
    cv::boxFilter(front_ & 1, in_front, CV_8U, {kAround, kAround}, {-1, -1}, false, cv::BORDER_REPLICATE);
    cv::Mat1b(in_front > kAround * kAround / 2).copyTo(front_, along_z_m == 0);
  }

  DisplacedDepth depth_;
  const CameraUpload& picture_;
  const ObjectLayer& objects_;
  cv::Rect bounds_, window_;
  MatteReach reach_;
  cv::Mat1b front_;  ///< nearer than the objects
  std::optional<Core> core_;
  std::optional<OutlineDistance> away_;
  std::optional<OutlineMatte> matte_;
  std::vector<cv::Point> pixels_;
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
  const auto hide_at = [&](const cv::Point& pixel, OutlineMatte::Reader& mixtures) {
    const std::size_t i = *objects.index(pixel.x, pixel.y);
    if (front.hides(pixel)) {
      objects.coverage.data[i] = 0;
      set_at(objects.radiance, i, Rgb::Zero());
      return;
    }
    const OutlineMatte::Mixture mixture = mixtures.at(pixel.x, pixel.y);
    const float kept = 1 - mixture.foreground;
    const float coverage = objects.coverage.data[i] *= kept;
    // (1 - coverage) C + coverage (C - B) = C - coverage B: removes the background's part of the mixture.
    const reconstruct::Simd4 removed = mixture.own - mixture.behind;
    set_at(objects.radiance, i,
           kept * radiance_at(objects.radiance, i) + coverage * Rgb(removed[0], removed[1], removed[2]));
  };
  for_each_block(static_cast<int>(front.pixels().size()), kMatteBlock, [&](int first, int last) {
    OutlineMatte::Reader mixtures = front.mixtures();
    for (int k = first; k < last; ++k) hide_at(front.pixels()[static_cast<std::size_t>(k)], mixtures);
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
