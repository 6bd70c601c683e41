#include "relight/compose/change_matte.h"

#include <algorithm>
#include <limits>
#include <opencv2/imgproc.hpp>
#include <optional>
#include <utility>
#include <vector>

#include "relight/compose/outline_matte.h"
#include "relight/compose/parameters.h"
#include "relight/tracing/parallel_for.h"

namespace lumigraft::relight {
namespace {

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
  /// The neighbourhood reaches `reach_px` or farther to all sides.
  ChangeSpan(const capture::Image<float>& change, int reach_px)
      : change_(change),
        edge_(reach_px),
        columns_((change.width - 1) / edge_ + 1),
        rows_((change.height - 1) / edge_ + 1),
        squares_(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_)),
        spans_(squares_.size(), -1.0f) {}

  float at(int u, int v) {
    const int x = u / edge_, y = v / edge_;
    float& span = spans_[index(x, y)];
    if (span >= 0) return span;
    Rgb least = Rgb::Constant(std::numeric_limits<float>::max()), most = -least;
    for (int j = std::max(y - 1, 0); j <= std::min(y + 1, rows_ - 1); ++j) {
      for (int i = std::max(x - 1, 0); i <= std::min(x + 1, columns_ - 1); ++i) {
        const Range& of = square(i, j);
        least = least.min(of.least);
        most = most.max(of.most);
      }
    }
    return span = (most - least).maxCoeff();
  }

 private:
  struct Range {
    Rgb least = Rgb::Constant(std::numeric_limits<float>::max()), most = -least;
    bool found = false;
  };

  std::size_t index(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(columns_) + static_cast<std::size_t>(x);
  }
  const Range& square(int x, int y) {
    Range& range = squares_[index(x, y)];
    if (std::exchange(range.found, true)) return range;
    for (int v = y * edge_; v < std::min((y + 1) * edge_, change_.height); ++v) {
      for (int u = x * edge_; u < std::min((x + 1) * edge_, change_.width); ++u) {
        const Rgb value = radiance_at(change_, static_cast<std::size_t>(v * change_.width + u));
        range.least = range.least.min(value);
        range.most = range.most.max(value);
      }
    }
    return range;
  }

  const capture::Image<float>& change_;
  int edge_, columns_, rows_;
  std::vector<Range> squares_;
  std::vector<float> spans_;  ///< by square; negative: not known
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
  ChangeSpan span(change, reach.matte_px);
  std::vector<cv::Point> pixels;
  away.for_each_near([&](int x, int y, float away_px) {
    const int u = x + window.x, v = y + window.y;
    if (!matte.reaches(u, v, away_px)) return;
    const Rgb own = picture.radiance(static_cast<std::size_t>(v * width + u));
    if (span.at(u, v) >= kCompose.matte_change * own.maxCoeff()) pixels.emplace_back(u, v);
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
