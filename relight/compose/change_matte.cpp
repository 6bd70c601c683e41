#include "relight/compose/change_matte.h"

#include <algorithm>
#include <limits>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <vector>

#include "reconstruct/math/simd4.h"
#include "relight/compose/outline_matte.h"
#include "relight/compose/parameters.h"
#include "relight/tracing/parallel_for.h"

namespace lumigraft::relight {
namespace {

using reconstruct::Simd4;

constexpr int kPixelBlock = 256;  // per thread at a time

/// Ratio of two radiances, bounded where one is dark.
Rgb detail(const Rgb& radiance, const Rgb& over) {
  return (radiance / over.max(1e-5f)).max(1 / kCompose.max_detail).min(kCompose.max_detail);
}

cv::Rect with_margin_px(const cv::Rect& bounds, int by_px) {
  return {bounds.x - by_px, bounds.y - by_px, bounds.width + 2 * by_px, bounds.height + 2 * by_px};
}

/// Of the change in the neighbourhood of a pixel, its span, W/sr/m²: where it is small a pixel's own change is right.
class ChangeSpan {
 public:
  /// Of the pixels of `window` in the image. The neighbourhood reaches `reach_px` or farther to all sides.
  ChangeSpan(const capture::Image<float>& change, int reach_px, const cv::Rect& window)
      : change_(change), edge_(reach_px) {
    const cv::Point first = square_of(window.x, window.y), last = square_of(window.br().x - 1, window.br().y - 1);
    squares_ = cv::Rect(first, last + cv::Point(1, 1));
    const cv::Rect around = with_margin_px(squares_, 1);
    std::vector<Range> ranges(static_cast<std::size_t>(around.area()));
    const auto range_at = [&](int x, int y) -> Range& {
      return ranges[static_cast<std::size_t>((y - around.y) * around.width + x - around.x)];
    };
    for_each_pixel(around.width, around.height, 2,
                   [&](int x, int y) { range_at(x + around.x, y + around.y) = square(x + around.x, y + around.y); });
    spans_.resize(static_cast<std::size_t>(squares_.area()));
    for (int y = squares_.y; y < squares_.br().y; ++y) {
      for (int x = squares_.x; x < squares_.br().x; ++x) {
        Range all;
        for (int k = 0; k < 9; ++k) {
          const Range& near = range_at(x + k % 3 - 1, y + k / 3 - 1);
          all.least = reconstruct::min(all.least, near.least);
          all.most = reconstruct::max(all.most, near.most);
        }
        const Simd4 span = all.most - all.least;
        spans_[index(x, y)] = std::max({span[0], span[1], span[2]});
      }
    }
  }

  float at(int u, int v) const {
    const cv::Point square = square_of(u, v);
    return spans_[index(square.x, square.y)];
  }

 private:
  struct Range {
    Simd4 least = reconstruct::broadcast(std::numeric_limits<float>::max()), most = -least;
  };

  cv::Point square_of(int u, int v) const { return {u / edge_, v / edge_}; }
  std::size_t index(int x, int y) const {
    return static_cast<std::size_t>((y - squares_.y) * squares_.width + x - squares_.x);
  }
  Range square(int x, int y) const {
    Range range;
    for (int v = std::max(y * edge_, 0); v < std::min((y + 1) * edge_, change_.height); ++v) {
      for (int u = std::max(x * edge_, 0); u < std::min((x + 1) * edge_, change_.width); ++u) {
        const float* of_pixel = &change_.data[3 * static_cast<std::size_t>(v * change_.width + u)];
        const Simd4 value{of_pixel[0], of_pixel[1], of_pixel[2], 0};
        range.least = reconstruct::min(value, range.least);  // what is not a number changes neither
        range.most = reconstruct::max(value, range.most);
      }
    }
    return range;
  }

  const capture::Image<float>& change_;
  int edge_;
  cv::Rect squares_;          ///< that have pixels
  std::vector<float> spans_;  ///< by square
};

/// What the composer adds to a pixel's radiance, from the changes on both sides.
std::optional<Rgb> divided(const OutlineMatte::Mixture& mixture, const Rgb& own_change, float covered) {
  if (!mixture.both) return std::nullopt;
  // The pixel's own change is of one side, and proportional to the mixture's radiance instead of that side's.
  const float part = mixture.in_front ? mixture.foreground : 1 - mixture.foreground;
  const Rgb &side = mixture.in_front ? mixture.front : mixture.behind,
            &other = mixture.in_front ? mixture.behind : mixture.front;
  const Rgb unmixed = part > 0.5f ? ((mixture.own - (1 - part) * other) / part).max(0.0f).eval() : side;
  const Rgb of_side = own_change * detail(unmixed, mixture.own);
  const Rgb &front = mixture.in_front ? of_side : mixture.values_front,
            &behind = mixture.in_front ? mixture.values_behind : of_side;
  const float alpha = mixture.foreground, room = 1 - covered * (1 - alpha);  // what the composer leaves of the room
  if (!(room > 0)) return std::nullopt;
  return (alpha * front + (1 - alpha) * (1 - covered) * behind) / room;
}

}  // namespace

void divide_change(const CurrentDepth& depth, const CameraUpload& picture, const capture::Image<std::uint8_t>& front,
                   const ObjectLayer& objects, capture::Image<float>& change) {
  const int width = change.width, height = change.height;
  const cv::Mat1b all(height, width, const_cast<std::uint8_t*>(front.data.data()));
  const cv::Rect outlines = cv::boundingRect(all);
  if (outlines.empty()) return;
  const MatteReach reach(width);
  // Of the pixels that may be mixtures, and of those that give colours.
  const cv::Rect window = with_margin_px(outlines, 2 * reach.samples_px) & cv::Rect(0, 0, width, height);
  const OutlineDistance away(all(window), reach.samples_px);
  OutlineMatte matte({depth}, picture, window.tl(), away, &change);
  const ChangeSpan span(change, reach.matte_px, window);
  const std::vector<cv::Point> pixels =
      found_in_rows<cv::Point>(window.height, [&](int y, std::vector<cv::Point>& found) {
        away.for_each_near(y, [&](int x, float away_px) {
          const int u = x + window.x, v = y + window.y;
          if (!matte.reaches(u, v, away_px)) return;
          const float apart = span.at(u, v);
          if (apart > 0 &&
              apart >= kCompose.matte_change * picture.radiance(static_cast<std::size_t>(v * width + u)).maxCoeff())
            found.emplace_back(u, v);
        });
      });
  matte.prepare(pixels);
  std::vector<std::optional<Rgb>> found(pixels.size());
  for_each_index(pixels.size(), kPixelBlock, [&](std::size_t k) {
    const cv::Point& p = pixels[k];
    const auto i = objects.index(p.x, p.y);
    found[k] = divided(matte.at(p.x, p.y), radiance_at(change, static_cast<std::size_t>(p.y * width + p.x)),
                       i ? objects.coverage.data[*i] : 0);
  });
  for (std::size_t k = 0; k < pixels.size(); ++k) {
    if (found[k]) set_at(change, static_cast<std::size_t>(pixels[k].y * width + pixels[k].x), *found[k]);
  }
}

}  // namespace lumigraft::relight
