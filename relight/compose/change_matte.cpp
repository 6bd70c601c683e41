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

using reconstruct::broadcast;
using reconstruct::Simd4;

constexpr int kPixelBlock = 256;  // per thread at a time

/// Ratio of two radiances, bounded where one is dark.
Simd4 detail(Simd4 radiance, Simd4 over) {
  using reconstruct::max, reconstruct::min;
  return min(max(radiance / max(over, broadcast(1e-5f)), broadcast(1 / kCompose.max_detail)),
             broadcast(kCompose.max_detail));
}

cv::Rect with_margin_px(const cv::Rect& bounds, int by_px) {
  return {bounds.x - by_px, bounds.y - by_px, bounds.width + 2 * by_px, bounds.height + 2 * by_px};
}

/// Of the change in the neighbourhood of a pixel, its span, W/sr/m²: where it is small a pixel's own change is right.
class ChangeSpan {
 public:
  /// Of the pixels of `window` in the image. The neighbourhood reaches `reach_px` or farther to all sides.
  ChangeSpan(const capture::Image<float>& change, int reach_px, const cv::Rect& window)
      : change_(change), edge_(reach_px), left_(window.x) {
    const cv::Point first = square_of(window.x, window.y), last = square_of(window.br().x - 1, window.br().y - 1);
    squares_ = cv::Rect(first, last + cv::Point(1, 1));
    for (int u = window.x; u < window.br().x; ++u) column_of_.push_back(u / edge_ - squares_.x);
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
    return spans_[static_cast<std::size_t>((v / edge_ - squares_.y) * squares_.width +
                                           column_of_[static_cast<std::size_t>(u - left_)])];
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
  int edge_, left_;
  std::vector<int> column_of_;  ///< of squares, by pixel from the window's left: divisions are slow
  cv::Rect squares_;            ///< that have pixels
  std::vector<float> spans_;    ///< by square
};

/// What the composer adds to a pixel's radiance, from the changes on both sides.
std::optional<Simd4> divided(const OutlineMatte::Mixture& mixture, Simd4 own_change, float covered) {
  if (!mixture.both) return std::nullopt;
  // The pixel's own change is of one side, and proportional to the mixture's radiance instead of that side's.
  const float part = mixture.in_front ? mixture.foreground : 1 - mixture.foreground;
  const Simd4 side = mixture.in_front ? mixture.front : mixture.behind,
              other = mixture.in_front ? mixture.behind : mixture.front;
  const Simd4 unmixed =
      part > 0.5f ? reconstruct::max((mixture.own - broadcast(1 - part) * other) * broadcast(1 / part), Simd4{}) : side;
  const Simd4 of_side = own_change * detail(unmixed, mixture.own);
  const Simd4 front = mixture.in_front ? of_side : mixture.values_front,
              behind = mixture.in_front ? mixture.values_behind : of_side;
  const float alpha = mixture.foreground, room = 1 - covered * (1 - alpha);  // what the composer leaves of the room
  if (!(room > 0)) return std::nullopt;
  return broadcast(alpha / room) * front + broadcast((1 - alpha) * (1 - covered) / room) * behind;
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
  // Each pixel reads only its own change: those of others are in the matte's sums.
  for_each_block(static_cast<int>(pixels.size()), kPixelBlock, [&](int first, int last) {
    OutlineMatte::Reader mixtures(matte);
    for (int k = first; k < last; ++k) {
      const cv::Point& p = pixels[static_cast<std::size_t>(k)];
      const auto i = objects.index(p.x, p.y);
      float* own = &change.at(p.x, p.y);
      const auto found =
          divided(mixtures.at(p.x, p.y), Simd4{own[0], own[1], own[2], 0}, i ? objects.coverage.data[*i] : 0);
      for (int c = 0; found && c < 3; ++c) own[c] = (*found)[c];
    }
  });
}

}  // namespace lumigraft::relight
