#include "relight/cpu_compositor.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "capture/camera/srgb.h"
#include "relight/compose/composer.h"
#include "relight/compose/foreground_matte.h"
#include "relight/compose/read_tiles.h"
#include "relight/compose/rgb_image.h"
#include "relight/compose/soften.h"
#include "relight/passes/parameters.h"
#include "relight/tracing/parallel_for.h"

namespace lumigraft::relight {
namespace {

constexpr int kBlocks = 256;  ///< that a thread takes at a time

/// Slope of the sRGB curve over linear^(1/2.4) at each pixel value, in pixel values.
std::array<float, 256> slopes() {
  std::array<float, 256> slope;
  for (std::size_t code = 0; code < 256; ++code) {
    const float value = static_cast<float>(code) / 255;
    slope[code] = 255 * (value <= 0.04045f ? 2.4f * value : value + 0.055f);
  }
  return slope;
}

void multiply(const float* gain, std::uint8_t* code, int pixels) {
  static const std::array<float, 256> slope = slopes();
  const float more[3] = {gain[0] - 1, gain[1] - 1, gain[2] - 1};
  if (std::max({std::abs(more[0]), std::abs(more[1]), std::abs(more[2])}) * slope[255] < 0.5f) return;
  for (int i = 0; i < 3 * pixels; ++i) {
    const float now = static_cast<float>(code[i]) + slope[code[i]] * more[i % 3];
    code[i] = static_cast<std::uint8_t>(std::clamp(now + 0.5f, 0.0f, 255.0f));
  }
}

}  // namespace

void CpuCompositor::read(gpu::Device& device, const Screen& screen, const CameraUpload& camera,
                         const std::vector<char>& considered) {
  soft_.reset();
  width_ = screen.width;
  height_ = screen.height;
  fine_step_ = screen.fine_step;
  columns_ = (width_ + kTile_px - 1) / kTile_px;
  const std::size_t pixels = static_cast<std::size_t>(width_) * static_cast<std::size_t>(height_);
  kinds_.resize(considered.size(), Kind::untouched);
  for (std::size_t i = 0; i < considered.size(); ++i) {
    if (!considered[i]) continue;
    const auto columns = static_cast<std::size_t>(columns_);
    if (kinds_[i] == Kind::object)
      clear_objects(static_cast<std::uint32_t>(i % columns | i / columns << 16), &objects_);
    kinds_[i] = Kind::untouched;
  }
  gain_.resize(3 * pixels);

  const auto mark = [&](const std::vector<std::uint32_t>& places, Kind kind) {
    for (const std::uint32_t place : places) {
      kinds_[(place >> 16) * static_cast<std::size_t>(columns_) + (place & 0xffff)] = kind;
    }
  };
  const Tiles& tiles = *screen.tiles;
  mark(tiles.smooth_places(), Kind::smooth);
  mark(tiles.shaded_alone_places(), Kind::real);
  mark(tiles.object_places(), Kind::object);

  std::vector<std::uint32_t> fine = tiles.shaded_alone_places();
  fine.insert(fine.end(), tiles.object_places().begin(), tiles.object_places().end());
  const std::array<WantedTiles, 2> objects = object_tiles(screen, tiles.object_places());
  const WantedTiles wanted[] = {{*screen.gain, tiles.smooth_places(), kPasses.smooth_px},
                                {*screen.live_gain, fine, fine_step_},
                                objects[0],
                                objects[1]};
  const TileReader reader(device, wanted);
  reader.read(0, 0, 3, &smooth_);
  reader.read(1, 0, 3, &fine_);
  for_each_index(fine.size(), kBlocks, [&](std::size_t i) { spread_fine(left_of(fine[i]), top_of(fine[i])); });
  read_objects(reader, 2, screen, camera.rays(), tiles.object_places(), &objects_);
}

/// A pixel between those of fine_step_ is their mean; neighbouring blocks of another kind are not used.
void CpuCompositor::spread_fine(int left, int top) {
  const int columns = (width_ + fine_step_ - 1) / fine_step_;
  const auto fine_at = [&](int u, int v) {
    const Kind kind = u < width_ && v < height_
                          ? kinds_[static_cast<std::size_t>(v / kTile_px * columns_ + u / kTile_px)]
                          : Kind::untouched;
    return kind == Kind::real || kind == Kind::object;
  };
  for (int v = top; v < std::min(top + kTile_px, height_); ++v) {
    for (int u = left; u < std::min(left + kTile_px, width_); ++u) {
      const int right = u % fine_step_ != 0 && fine_at(u + 1, v) ? 1 : 0;
      const int below = v % fine_step_ != 0 && fine_at(u, v + 1) && fine_at(u + right, v + 1) ? columns : 0;
      const float* first = &fine_[static_cast<std::size_t>(3 * (v / fine_step_ * columns + u / fine_step_))];
      float* gain = &gain_[static_cast<std::size_t>(3 * (v * width_ + u))];
      for (int c = 0; c < 3; ++c) {
        gain[c] = 0.25f * (first[c] + first[3 * right + c] + first[3 * below + c] + first[3 * (right + below) + c]);
      }
    }
  }
}

capture::Image<std::uint8_t> CpuCompositor::over(const CameraUpload& camera, const CurrentDepth& depth,
                                                 const MotionBlur& motion, float blur_px) {
  if (soft_px_ != blur_px || moving_ != motion.any()) soft_.reset();
  soft_px_ = blur_px;
  moving_ = motion.any();
  if (!soft_ && moving_) soft_ = softened(motion.of(objects_), blur_px, width_, height_);
  if (!soft_ && blur_px > 0) soft_ = softened(objects_, blur_px, width_, height_);
  hidden_.reset();
  hidden_ = behind_foreground(depth, camera, shown());
  const ObjectLayer& objects = shown();
  capture::Image<std::uint8_t> picture = *camera.coded();
  for_each_index(kinds_.size(), kBlocks, [&](std::size_t i) {
    const int left = kTile_px * static_cast<int>(i % static_cast<std::size_t>(columns_));
    const int top = kTile_px * static_cast<int>(i / static_cast<std::size_t>(columns_));
    if (kinds_[i] == Kind::smooth) over_smooth(left, top, &picture);
    if (kinds_[i] == Kind::real) over_real(left, top, &picture);
    if (kinds_[i] == Kind::object) over_object(left, top, camera, objects, &picture);
  });
  if (soft_) over_outlines(camera, objects, &picture);
  return picture;
}

/// What a blur has moved beyond the blocks with objects.
void CpuCompositor::over_outlines(const CameraUpload& camera, const ObjectLayer& objects,
                                  capture::Image<std::uint8_t>* picture) const {
  const capture::SrgbTable& srgb = capture::srgb_table();
  for (int v = objects.top; v < objects.top + objects.coverage.height; ++v) {
    for (int u = objects.left; u < objects.left + objects.coverage.width; ++u) {
      const std::size_t i = *objects.index(u, v), at = picture->index(u, v);
      if (kind_at(u, v) == Kind::object || !(objects.coverage.data[i] > 0)) continue;
      const Eigen::Array3f exposure = camera.transmission(at / 3) * camera.exposure();
      for (std::size_t c = 0; c < 3; ++c) {
        std::uint8_t& code = picture->data[at + c];
        code = srgb.code(composed(srgb.linear[code],
                                  exposure[static_cast<Eigen::Index>(c)] * objects.radiance.data[3 * i + c],
                                  objects.coverage.data[i]));
      }
    }
  }
}

void CpuCompositor::over_smooth(int left, int top, capture::Image<std::uint8_t>* picture) const {
  const int columns = (width_ + kPasses.smooth_px - 1) / kPasses.smooth_px;
  for (int v = top; v < std::min(top + kTile_px, height_); ++v) {
    for (int u = left; u < std::min(left + kTile_px, width_); u += kPasses.smooth_px) {
      const auto cell = static_cast<std::size_t>(v / kPasses.smooth_px * columns + u / kPasses.smooth_px);
      multiply(&smooth_[3 * cell], &picture->at(u, v), std::min(kPasses.smooth_px, width_ - u));
    }
  }
}

void CpuCompositor::over_real(int left, int top, capture::Image<std::uint8_t>* picture) const {
  const capture::SrgbTable& srgb = capture::srgb_table();
  for (int v = top; v < std::min(top + kTile_px, height_); ++v) {
    const std::size_t first = picture->index(left, v), last = picture->index(std::min(left + kTile_px, width_), v);
    for (std::size_t i = first; i < last; ++i) {
      if (gain_[i] == 1) continue;
      std::uint8_t& code = picture->data[i];
      code = srgb.code(gain_[i] * srgb.linear[code]);
    }
  }
}

void CpuCompositor::over_object(int left, int top, const CameraUpload& camera, const ObjectLayer& objects,
                                capture::Image<std::uint8_t>* picture) const {
  const capture::SrgbTable& srgb = capture::srgb_table();
  for (int v = top; v < std::min(top + kTile_px, height_); ++v) {
    for (int u = left; u < std::min(left + kTile_px, width_); ++u) {
      const std::size_t at = picture->index(u, v);
      const auto i = objects.index(u, v);
      const float* gain = &gain_[at];
      const Rgb object = i ? radiance_at(objects.radiance, *i) : Rgb::Zero();
      const float coverage = i ? objects.coverage.data[*i] : 0;
      const Eigen::Array3f exposure = camera.transmission(at / 3) * camera.exposure();
      for (std::size_t c = 0; c < 3; ++c) {
        const auto k = static_cast<Eigen::Index>(c);
        if (gain[c] == 1 && object[k] == 0 && coverage == 0) continue;
        std::uint8_t& code = picture->data[at + c];
        code = srgb.code(composed(gain[c] * srgb.linear[code], exposure[k] * object[k], coverage));
      }
    }
  }
}

}  // namespace lumigraft::relight
