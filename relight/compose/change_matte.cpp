#include "relight/compose/change_matte.h"

#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>
#include <utility>
#include <vector>

#include "relight/compose/outline_matte.h"
#include "relight/compose/parameters.h"
#include "relight/tracing/parallel_for.h"

namespace lumigraft::relight {
namespace {

/// Ratio of two radiances, bounded where one is dark.
Rgb detail(const Rgb& radiance, const Rgb& over) {
  return (radiance / over.max(1e-5f)).max(1 / kCompose.max_detail).min(kCompose.max_detail);
}

cv::Rect grown(const cv::Rect& bounds, int by_px) {
  return {bounds.x - by_px, bounds.y - by_px, bounds.width + 2 * by_px, bounds.height + 2 * by_px};
}

/// Bounds of the pixels that change.
cv::Rect bounds_of(const capture::Image<float>& change) {
  cv::Mat1b any(change.height, change.width);
  for_each_pixel(change.width, change.height, kRows, [&](int u, int v) {
    any(v, u) = (radiance_at(change, static_cast<std::size_t>(v * change.width + u)) != 0).any() ? 255 : 0;
  });
  return cv::boundingRect(any);
}

}  // namespace

void divide_change(const CurrentDepth& depth, const CameraUpload& picture, const capture::Image<std::uint8_t>& front,
                   const ObjectLayer& objects, capture::Image<float>& change) {
  const int width = change.width, height = change.height;
  const cv::Mat1b all(height, width, const_cast<std::uint8_t*>(front.data.data()));
  const cv::Rect image(0, 0, width, height), outlines = cv::boundingRect(all);
  if (outlines.empty()) return;
  const MatteReach reach(width);
  const cv::Rect divided = grown(bounds_of(change), reach.matte_px) & grown(outlines, reach.samples_px) & image;
  if (divided.empty()) return;
  // Colours are taken from as far as samples_px, where sides are certain at twice sigma.
  const cv::Rect window = grown(divided, reach.samples_px + static_cast<int>(std::ceil(2 * reach.sigma_px))) & image;
  if (cv::countNonZero(all(window)) == 0) return;
  const OutlineMatte matte({depth}, picture, window.tl(), all(window));
  // Of the change in the neighbourhood of a pixel, its span: where it is small a pixel's own change is right.
  const cv::Mat_<cv::Vec3f> light(height, width, reinterpret_cast<cv::Vec3f*>(change.data.data()));
  const cv::Mat near = cv::getStructuringElement(cv::MORPH_RECT, {2 * reach.matte_px + 1, 2 * reach.matte_px + 1});
  cv::Mat_<cv::Vec3f> most, least;
  cv::dilate(light(window), most, near);
  cv::erode(light(window), least, near);
  std::vector<std::vector<std::pair<std::size_t, Rgb>>> rows(static_cast<std::size_t>(divided.height));
  for_each_pixel(divided.width, divided.height, kRows, [&](int x, int y) {
    const int u = x + divided.x, v = y + divided.y;
    if (!matte.reaches(u, v)) return;
    const cv::Point here = cv::Point(u, v) - window.tl();
    const cv::Vec3f span = most(here) - least(here);
    const auto pixel = static_cast<std::size_t>(v * width + u);
    const Rgb own = picture.radiance(pixel);
    if (std::max({span[0], span[1], span[2]}) < kCompose.matte_change * own.maxCoeff()) return;
    const OutlineMatte::Mixture mixture = matte.at(u, v, &change);
    if (!mixture.both) return;
    const auto i = objects.index(u, v);
    // The pixel's own change is of one side, and proportional to the mixture's radiance instead of that side's.
    const float part = mixture.in_front ? mixture.foreground : 1 - mixture.foreground;
    const Rgb &side = mixture.in_front ? mixture.front : mixture.behind,
              &other = mixture.in_front ? mixture.behind : mixture.front;
    const Rgb unmixed = part > 0.5f ? ((own - (1 - part) * other) / part).max(0.0f).eval() : side;
    const Rgb of_side = radiance_at(change, pixel) * detail(unmixed, own);
    const Rgb front_change = mixture.in_front ? of_side : mixture.values_front,
              behind_change = mixture.in_front ? mixture.values_behind : of_side;
    const float alpha = mixture.foreground, covered = i ? objects.coverage.data[*i] : 0,
                room = 1 - covered * (1 - alpha);  // what the composer leaves of the room
    if (!(room > 0)) return;
    rows[static_cast<std::size_t>(y)].emplace_back(
        pixel, (alpha * front_change + (1 - alpha) * (1 - covered) * behind_change) / room);
  });
  for (const auto& row : rows) {
    for (const auto& [pixel, value] : row) set_at(change, pixel, value);
  }
}

}  // namespace lumigraft::relight
