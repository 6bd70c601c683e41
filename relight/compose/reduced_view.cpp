#include "relight/compose/reduced_view.h"

#include <algorithm>
#include <array>
#include <limits>

#include "capture/camera/radiance.h"
#include "capture/camera/resized_camera.h"
#include "relight/tracing/parallel_for.h"

namespace lumigraft::relight {
namespace {

capture::ColorCamera reduced(capture::ColorCamera camera, int scale) {
  const capture::CameraModel& full = camera.model;
  camera.model =
      capture::resized(full, 1.0 / scale, (full.width + scale - 1) / scale, (full.height + scale - 1) / scale);
  return camera;
}

/// Calls `work(x, y, left, top, right, bottom)` for each square of pixels of an image.
template <typename Work>
void for_each_square(const capture::CameraModel& image, int scale, Work work) {
  const int width = (image.width + scale - 1) / scale, height = (image.height + scale - 1) / scale;
  for_each_index(height, kRows, [&](int y) {
    for (int x = 0; x < width; ++x)
      work(x, y, x * scale, y * scale, std::min((x + 1) * scale, image.width), std::min((y + 1) * scale, image.height));
  });
}

std::uint8_t mean(int sum, int count, int max) {
  return max >= capture::kFullScale ? static_cast<std::uint8_t>(max)
                                    : static_cast<std::uint8_t>((sum + count / 2) / count);
}
float mean(float sum, int count, float) { return sum / static_cast<float>(count); }

/// `Sum`: the type in which values are added.
template <typename Sum, typename T>
capture::Image<T> means(const capture::Image<T>& image, const capture::CameraModel& full, int scale) {
  capture::Image<T> small((full.width + scale - 1) / scale, (full.height + scale - 1) / scale, 3);
  for_each_square(full, scale, [&](int x, int y, int left, int top, int right, int bottom) {
    std::array<Sum, 3> sum{}, max{};
    for (int v = top; v < bottom; ++v) {
      const T* value = &image.at(left, v);
      for (int u = left; u < right; ++u) {
        for (std::size_t c = 0; c < 3; ++c, ++value) {
          sum[c] += *value;
          max[c] = std::max<Sum>(max[c], *value);
        }
      }
    }
    const int count = (right - left) * (bottom - top);
    for (std::size_t c = 0; c < 3; ++c) small.at(x, y, static_cast<int>(c)) = mean(sum[c], count, max[c]);
  });
  return small;
}

}  // namespace

ReducedView::ReducedView(const capture::ColorCamera& camera, int scale)
    : scale_(scale), full_(camera.model), camera_(reduced(camera, scale)), picture_(camera_), rays_(camera_.model) {}

std::shared_ptr<const capture::Frame> ReducedView::reduced_color(const capture::Frame& color) const {
  auto small = std::make_shared<capture::Frame>();
  small->stamp = color.stamp;
  small->exposure = color.exposure;
  if (!color.encoded.empty()) small->encoded = means<int>(color.encoded, full_, scale_);
  if (!color.radiance.empty()) small->radiance = means<float>(color.radiance, full_, scale_);
  return small;
}

/// Per square the value nearest to its centre that is not 0.
template <typename T>
capture::Image<T> ReducedView::sampled(const capture::Image<T>& image) const {
  capture::Image<T> small(camera_.model.width, camera_.model.height, 1);
  for_each_square(full_, scale_, [&](int x, int y, int left, int top, int right, int bottom) {
    const int centre_u = left + central_offset(scale_), centre_v = top + central_offset(scale_);
    int nearest = std::numeric_limits<int>::max();
    for (int v = top; v < bottom; ++v) {
      for (int u = left; u < right; ++u) {
        const int off = (u - centre_u) * (u - centre_u) + (v - centre_v) * (v - centre_v);
        if (image.at(u, v) == 0 || off >= nearest) continue;
        nearest = off;
        small.at(x, y) = image.at(u, v);
      }
    }
  });
  return small;
}

void ReducedView::take(const capture::FrameSet& frame) {
  capture::FrameSet small;
  small.index = frame.index;
  small.time_ns = frame.time_ns;
  small.color = reduced_color(*frame.color);
  small.color_gain = frame.color_gain;
  if (frame.color_vignetting != vignetting_) {
    vignetting_ = frame.color_vignetting;
    reduced_vignetting_ = vignetting_ ? std::make_shared<const capture::Image<float>>(sampled(*vignetting_)) : nullptr;
  }
  small.color_vignetting = reduced_vignetting_;
  picture_.take(small);
  const capture::Image<float>* depth_m = depth_of(frame, full_);
  depth_m_ = depth_m ? sampled(*depth_m) : capture::Image<float>();
}

}  // namespace lumigraft::relight
