#include "relight/compose/composer.h"

#include <algorithm>
#include <array>
#include <cstddef>

#include "capture/camera/srgb.h"
#include "reconstruct/math/simd4.h"
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

}  // namespace

void compose(const CameraUpload& camera, const RoomChange& change, const ObjectLayer& objects,
             capture::Image<std::uint8_t>* picture) {
  const capture::SrgbTable& srgb = capture::srgb_table();
  static const Unchanged unchanged;
  const Simd4 exposure = channels_of(camera.exposure());
  const bool exact = camera.coded_exactly(), vignetting = camera.vignetting() != nullptr;
  // By which a change may yet grow: the lens transmits all of the light at most.
  const Simd4 flicker = broadcast(change.proportional && change.radiance ? kCompose.max_flicker : 1);
  const Simd4 grown = flicker * broadcast(camera.exposure().maxCoeff());
  const int width = picture->width;
  for_each_index(picture->height, kRows, [&](int v) {
    const std::size_t row = static_cast<std::size_t>(v) * static_cast<std::size_t>(width);
    const int y = v - objects.top;
    const bool in_rows = y >= 0 && y < objects.coverage.height;
    const int left = in_rows ? objects.left : width, right = in_rows ? objects.left + objects.coverage.width : width;
    const auto write = [&](Simd4 coded_light, std::uint8_t* codes) {
      codes[0] = srgb.code(coded_light[0]);
      codes[1] = srgb.code(coded_light[1]);
      codes[2] = srgb.code(coded_light[2]);
    };
    /// Of kPixels pixels, within the row.
    const auto any_covered = [&](int u) {
      if (u + Unchanged::kPixels <= left || u >= right) return false;
      if (u < left || u + Unchanged::kPixels > right) return true;
      return reconstruct::any(reconstruct::load(&objects.coverage.at(u - left, y)) != Simd4{});
    };
    for (int u = 0; u < width; ++u) {
      const std::size_t pixel = row + static_cast<std::size_t>(u);
      const float* of_pixel = &change.delta.data[3 * pixel];
      if (exact && u + Unchanged::kPixels <= width && !any_covered(u) && unchanged.hold_all(of_pixel, grown)) {
        u += Unchanged::kPixels - 1;
        continue;
      }
      const float coverage = u >= left && u < right ? objects.coverage.at(u - left, y) : 0;
      std::uint8_t* codes = &picture->data[3 * pixel];
      if (coverage == 1) {  // it hides the room
        const Simd4 object = finite_or_zero(channels_of(&objects.radiance.at(u - left, y)));
        const Simd4 light = reconstruct::max(object, Simd4{}) * exposure;
        write(vignetting ? light * broadcast(camera.transmission(pixel)) : light, codes);
        continue;
      }
      Simd4 delta = channels_of(of_pixel);
      // Most of the room changes by less than a pixel value.
      const Simd4 transmitted = vignetting ? exposure * broadcast(camera.transmission(pixel)) : exposure;
      if (coverage == 0 && exact && unchanged.holds(codes, flicker * transmitted * delta)) continue;
      delta = finite_or_zero(delta);
      if (coverage == 0 && !reconstruct::any(delta != Simd4{})) continue;
      Simd4 light = channels_of(camera.radiance(pixel));
      if (change.radiance) {
        const Simd4 then = channels_of(&change.radiance->data[3 * pixel]);
        if (camera.clipped(pixel)) {
          const auto clipped = [&](std::size_t channel) { return camera.clipped(pixel, channel) ? -1 : 0; };
          const reconstruct::Simd4Int clips{clipped(0), clipped(1), clipped(2), 0};
          light = reconstruct::select(clips, reconstruct::max(light, then), light);
        }
        if (change.proportional) delta *= now_over(light, then);
      }
      if (coverage == 0 && exact && unchanged.holds(codes, transmitted * delta)) continue;
      light = reconstruct::max(light + delta, Simd4{});
      if (coverage != 0) {
        const Simd4 object = finite_or_zero(channels_of(&objects.radiance.at(u - left, y)));
        light = reconstruct::max(composed(light, object, broadcast(coverage)), Simd4{});
      }
      write(light * transmitted, codes);
    }
  });
}

}  // namespace lumigraft::relight
