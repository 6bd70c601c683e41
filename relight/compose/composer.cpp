#include "relight/compose/composer.h"

#include <algorithm>
#include <array>
#include <cstddef>

#include "capture/camera/srgb.h"
#include "reconstruct/math/simd4.h"
#include "reconstruct/math/simd_target.h"
#include "relight/compose/parameters.h"
#include "relight/tracing/parallel_for.h"

namespace lumigraft::relight {
namespace {

using reconstruct::broadcast;
using reconstruct::Simd4;

/// The three channels of a pixel, and 0.
template <typename Channels>
Simd4 channels_of(const Channels& of_pixel) {
  return Simd4{of_pixel[0], of_pixel[1], of_pixel[2], 0};
}

Simd4 finite_or_zero(Simd4 light) {
  const bool finite = !reconstruct::any(light - light != Simd4{});
  return finite ? light : Simd4{};
}

/// Between frames radiance changes by noise, by more only if light does, which the change of light then follows.
Simd4 now_over(Simd4 now, Simd4 before) {
  const Simd4 ratio = now / reconstruct::max(before, broadcast(1e-6f));
  const Simd4 bounded =
      reconstruct::max(reconstruct::min(ratio, broadcast(kCompose.max_flicker)), broadcast(1 / kCompose.max_flicker));
  return reconstruct::select(before > 0, bounded, broadcast(1));
}

/// Which changes of linear light surely do not change pixel values that are the camera's own.
class Unchanged {
 public:
  Unchanged() {
    constexpr float kHalf = 0.49f;  // of a pixel value; the rest is for rounding
    for (std::size_t code = 0; code < linear_.size(); ++code) {
      const auto value = static_cast<float>(code);
      const auto light = [&](float encoded) { return capture::srgb_to_linear(std::max(encoded, 0.0f) / 255); };
      const float own = light(value);
      linear_[code] = code == 0 ? light(kHalf) : std::min(own - light(value - kHalf), light(value + kHalf) - own);
    }
    least_ = *std::min_element(linear_.begin(), linear_.end());
    linear_.back() = 0;  // what clips may be restored
  }
  /// Of a pixel with these values. False where the change is not finite.
  bool holds(const std::uint8_t* codes, Simd4 change) const {
    const Simd4 bound{linear_[codes[0]], linear_[codes[1]], linear_[codes[2]], 1};
    return all(reconstruct::abs(change) < bound);
  }
  /// Of any kPixels pixels. `factor`: what their changes, three channels each, are multiplied by.
  static constexpr int kPixels = 4;
  bool hold_all(const float* changes, Simd4 factor) const {
    const Simd4 most = reconstruct::max(reconstruct::abs(reconstruct::load(changes)),
                                        reconstruct::max(reconstruct::abs(reconstruct::load(changes + 4)),
                                                         reconstruct::abs(reconstruct::load(changes + 8))));
    // A maximum may lose what is not a number, a sum does not.
    const Simd4 sum = reconstruct::load(changes) + reconstruct::load(changes + 4) + reconstruct::load(changes + 8);
    return all((factor * most < broadcast(least_)) & (sum - sum == Simd4{}));
  }

 private:
  static bool all(reconstruct::Simd4Int where) { return !reconstruct::any(~where); }

  std::array<float, 256> linear_;  ///< by pixel value
  float least_;                    ///< of any
};

const Unchanged& unchanged() {
  static const Unchanged one;
  return one;
}

/// Rows of a picture, for processors with and without wide registers.
class RowComposer {
 public:
  RowComposer(const CameraUpload& camera, const RoomChange& change, const ObjectLayer& objects,
              capture::Image<std::uint8_t>& picture)
      : camera_(camera),
        change_(change),
        objects_(objects),
        picture_(picture),
        exposure_(channels_of(camera.exposure())),
        // By which a change may yet grow: the lens transmits all of the light at most.
        flicker_(broadcast(change.proportional && change.radiance ? kCompose.max_flicker : 1)),
        grown_(flicker_ * broadcast(camera.exposure().maxCoeff())),
        exact_(camera.coded_exactly()),
        vignetting_(camera.vignetting() != nullptr) {}

  void compose(int v) const { compose_row(v); }
  LUMIGRAFT_SIMD8_TARGET void compose_wide(int v) const { compose_row(v); }

 private:
  [[gnu::always_inline]] inline void compose_row(int v) const;
  [[gnu::always_inline]] inline void write(Simd4 coded_light, std::uint8_t* codes) const {
    codes[0] = srgb_.code(coded_light[0]);
    codes[1] = srgb_.code(coded_light[1]);
    codes[2] = srgb_.code(coded_light[2]);
  }

  const CameraUpload& camera_;
  const RoomChange& change_;
  const ObjectLayer& objects_;
  capture::Image<std::uint8_t>& picture_;
  Simd4 exposure_, flicker_, grown_;
  bool exact_, vignetting_;
  const capture::SrgbTable& srgb_ = capture::srgb_table();
  const Unchanged& unchanged_ = unchanged();
};

void RowComposer::compose_row(int v) const {
  const int width = picture_.width, y = v - objects_.top;
  const std::size_t row = static_cast<std::size_t>(v) * static_cast<std::size_t>(width);
  const bool in_rows = y >= 0 && y < objects_.coverage.height;
  const int left = in_rows ? objects_.left : width, right = in_rows ? objects_.left + objects_.coverage.width : width;
  for (int u = 0; u < width; ++u) {
    const std::size_t pixel = row + static_cast<std::size_t>(u);
    const float* of_pixel = &change_.delta.data[3 * pixel];
    const int end = u + Unchanged::kPixels;
    if (exact_ && end <= width) {
      const bool covered = end > left && u < right &&
                           (u < left || end > right ||
                            reconstruct::any(reconstruct::load(&objects_.coverage.at(u - left, y)) != Simd4{}));
      if (!covered && unchanged_.hold_all(of_pixel, grown_)) {
        u = end - 1;
        continue;
      }
    }
    const float coverage = u >= left && u < right ? objects_.coverage.at(u - left, y) : 0;
    std::uint8_t* codes = &picture_.data[3 * pixel];
    const Simd4 transmitted = vignetting_ ? exposure_ * broadcast(camera_.transmission(pixel)) : exposure_;
    if (coverage == 1) {  // it hides the room
      const Simd4 object = finite_or_zero(channels_of(&objects_.radiance.at(u - left, y)));
      write(reconstruct::max(object, Simd4{}) * transmitted, codes);
      continue;
    }
    Simd4 delta = channels_of(of_pixel);
    // Most of the room changes by less than a pixel value.
    if (coverage == 0 && exact_ && unchanged_.holds(codes, flicker_ * transmitted * delta)) continue;
    delta = finite_or_zero(delta);
    if (coverage == 0 && !reconstruct::any(delta != Simd4{})) continue;
    Simd4 light = channels_of(camera_.radiance(pixel));
    if (change_.radiance) {
      const Simd4 then = channels_of(&change_.radiance->data[3 * pixel]);
      if (camera_.clipped(pixel)) {
        const reconstruct::Simd4Int clips{-camera_.clipped(pixel, 0), -camera_.clipped(pixel, 1),
                                          -camera_.clipped(pixel, 2), 0};
        light = reconstruct::select(clips, reconstruct::max(light, then), light);
      }
      if (change_.proportional) delta *= now_over(light, then);
    }
    if (coverage == 0 && exact_ && unchanged_.holds(codes, transmitted * delta)) continue;
    light = reconstruct::max(light + delta, Simd4{});
    if (coverage != 0) {
      const Simd4 object = finite_or_zero(channels_of(&objects_.radiance.at(u - left, y)));
      light = reconstruct::max(composed(light, object, broadcast(coverage)), Simd4{});
    }
    write(light * transmitted, codes);
  }
}

}  // namespace

void compose(const CameraUpload& camera, const RoomChange& change, const ObjectLayer& objects,
             capture::Image<std::uint8_t>* picture) {
  const RowComposer rows(camera, change, objects, *picture);
  static const bool wide = reconstruct::simd8_supported();
  for_each_index(picture->height, kRows, [&](int v) { wide ? rows.compose_wide(v) : rows.compose(v); });
}

}  // namespace lumigraft::relight
