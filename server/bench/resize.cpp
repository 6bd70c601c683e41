#include "server/bench/resize.h"

#include <cmath>
#include <memory>
#include <utility>

#include "capture/camera/resized_camera.h"
#include "capture/camera/srgb.h"

namespace lumigraft::server {
namespace {

template <typename T>
capture::Image<T> resampled(const capture::Image<T>& from, int width, int height) {
  capture::Image<T> to(width, height, from.channels);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      for (int c = 0; c < from.channels; ++c) {
        to.at(x, y, c) = from.at(x * from.width / width, y * from.height / height, c);
      }
    }
  }
  return to;
}

}  // namespace

void resize_picture(double factor, capture::CameraModel& camera, capture::FrameSet& frame) {
  camera = capture::resized(camera, factor, static_cast<int>(std::lround(camera.width * factor)),
                            static_cast<int>(std::lround(camera.height * factor)));
  auto color = std::make_shared<capture::Frame>(*frame.color);
  if (!color->encoded.empty()) color->encoded = resampled(color->encoded, camera.width, camera.height);
  if (!color->radiance.empty()) color->radiance = resampled(color->radiance, camera.width, camera.height);
  frame.color = std::move(color);
  if (frame.depth) {
    auto depth = std::make_shared<capture::DepthFrame>(*frame.depth);
    depth->depth_m = resampled(depth->depth_m, camera.width, camera.height);
    frame.depth = std::move(depth);
  }
}

capture::Image<std::uint8_t> shrunk(const capture::Image<std::uint8_t>& srgb, int factor) {
  if (factor == 1) return srgb;
  capture::Image<std::uint8_t> small(srgb.width / factor, srgb.height / factor, srgb.channels);
  for (int y = 0; y < small.height; ++y) {
    for (int x = 0; x < small.width; ++x) {
      for (int c = 0; c < small.channels; ++c) {
        float sum = 0;
        for (int i = 0; i < factor * factor; ++i) {
          const std::uint8_t code = srgb.at(x * factor + i % factor, y * factor + i / factor, c);
          sum += capture::srgb_table().linear[code];
        }
        const float mean = sum / static_cast<float>(factor * factor);
        small.at(x, y, c) = capture::srgb_table().code(mean);
      }
    }
  }
  return small;
}

}  // namespace lumigraft::server
