#pragma once
// The observation of one voxel in one depth image and one colour image.
#include <Eigen/Core>
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <vector>

#include "capture/camera/camera_model.h"
#include "capture/camera/radiance.h"
#include "capture/frame.h"
#include "reconstruct/fusion/depth_preprocess.h"
#include "reconstruct/fusion/parameters.h"
#include "reconstruct/math/simd4.h"

namespace lumigraft::reconstruct {

/// Fast projection from the camera frame to pixels; lens distortion is interpolated from a table.
class PixelMap {
 public:
  explicit PixelMap(const capture::CameraModel& camera);
  Eigen::Vector2f pixel(float x_over_z, float y_over_z) const {
    const float u = fx_ * x_over_z + cx_, v = fy_ * y_over_z + cy_;
    return table_.empty() ? Eigen::Vector2f(u, v) : distorted(u, v);
  }
  void pixels(Simd4 x_over_z, Simd4 y_over_z, Simd4& u, Simd4& v) const {
    u = fx_ * x_over_z + cx_;
    v = fy_ * y_over_z + cy_;
    if (table_.empty()) return;
    for (int k = 0; k < 4; ++k) {
      const Eigen::Vector2f pixel = distorted(u[k], v[k]);
      u[k] = pixel.x();
      v[k] = pixel.y();
    }
  }

 private:
  Eigen::Vector2f distorted(float u, float v) const;

  static constexpr int kMargin = 32;
  float fx_, fy_, cx_, cy_;
  int width_, height_;
  std::vector<Eigen::Vector2f>
      table_;  ///< distorted pixel by undistorted pixel, with margin; empty if there is no distortion
};

struct DepthReading {
  float distance_m = 0;    ///< signed, to the observed plane; may exceed the truncation distance
  float weight = 0;        ///< 0 = not observed
  float facing = 0;        ///< cosine of incidence
  Eigen::Vector3f normal;  ///< of the plane, away from the camera
  bool edge = false;       ///< depth jumps between the pixels around
  bool visible = true;     ///< false: the voxel is hidden or outside the image, so its pixel shows another surface
};

class DepthLookup {
 public:
  DepthLookup(const PreparedDepth& view, const DepthPreprocessor& preprocessor, const PixelMap& map, float voxel_m,
              float truncation_m, float shell_m)
      : view_(view),
        preprocessor_(preprocessor),
        map_(map),
        voxel_m_(voxel_m),
        truncation_m_(truncation_m),
        shell_m_(shell_m),
        steady_depth_m_(preprocessor.noise().max_depth_m(kDepthLookup.steady_voxels * voxel_m /
                                                         std::max(view.noise_scale, 1e-6f))) {}

  /// A voxel outside the image is not observed if it is deeper than this, or more pixels away from the image.
  float extrapolation_depth_m() const { return steady_depth_m_; }
  float extrapolation_px() const {
    return kDepthLookup.rim_voxels * voxel_m_ * preprocessor_.focal() / kDepthLookup.min_depth_m;
  }

  /// Observes a voxel at `p` (camera frame, metres) that projects to `pixel`, which may be outside the image.
  DepthReading read(const Eigen::Vector3f& p, const Eigen::Vector2f& pixel) const {
    const float x = pixel.x() + 0.5f, y = pixel.y() + 0.5f;
    if (!(x >= 0 && y >= 0 && x < static_cast<float>(2 * view_.blocks_x) && y < static_cast<float>(2 * view_.blocks_y)))
      return outside_image(p, pixel);
    const int u = static_cast<int>(x), v = static_cast<int>(y);
    const PreparedDepth::Block& block = view_.blocks[static_cast<std::size_t>((v >> 1) * view_.blocks_x + (u >> 1))];
    if (block.jump < 0) return from_plane(p, block, block.distance_m);
    return near_jump(p, u, v);
  }
  /// The same for a voxel that projects to pixel (u, v), whose block is within reach of a jump.
  DepthReading near_jump(const Eigen::Vector3f& p, int u, int v) const;

 private:
  /// The distance is to the plane, not along the ray, so that it is right at grazing angles too.
  DepthReading from_plane(const Eigen::Vector3f& p, const PreparedDepth::Block& block, float distance_m) const {
    const float to_voxel = block.normal.dot(p);
    const float distance = distance_m - to_voxel;
    DepthReading reading;
    if (distance < -truncation_m_ || distance * p.z() < -kDepthLookup.behind_grazing * truncation_m_ * to_voxel)
      return reading;
    reading.distance_m = distance;
    reading.weight = block.weight;
    reading.facing = block.facing;
    reading.normal = block.normal;
    return reading;
  }
  DepthReading outside_image(const Eigen::Vector3f& p, const Eigen::Vector2f& pixel) const;
  DepthReading hidden_surface(const Eigen::Vector3f& p, std::int32_t jump) const;
  std::int32_t plane_behind(std::int32_t pixel) const;
  bool visible_on_plane(const Eigen::Vector3f& foot, const PreparedDepth::Jump& jump, const PreparedDepth::Block& block,
                        float distance_m) const;
  bool visible_at(const Eigen::Vector2f& pixel, const PreparedDepth::Block& block, float distance_m) const;
  const PreparedDepth::Block* plane_block(int u, int v) const;
  std::int32_t find_plane_block(int u, int v) const;
  Eigen::Vector3f surface(std::int32_t pixel) const {
    return preprocessor_.ray(pixel).homogeneous() / view_.inverse_depth[static_cast<std::size_t>(pixel)];
  }

  const PreparedDepth& view_;
  const DepthPreprocessor& preprocessor_;
  const PixelMap& map_;
  float voxel_m_, truncation_m_, shell_m_;
  float steady_depth_m_;  ///< depth up to which a plane may be extrapolated beyond its pixels
};

/// Radiance at positions of a colour image, converted from its pixel values only where it is read.
class ColorLookup {
 public:
  /// `picture` may be null or of another size than the camera: then there is nothing to read.
  /// `gain`: linear pixel value over exposure × radiance (FrameSet::color_gain). `vignetting`: FrameSet's, or null.
  ColorLookup(const capture::Frame* picture, const capture::Response& response, int width, int height,
              const Eigen::Array3f& gain = Eigen::Array3f::Ones(), const capture::Image<float>* vignetting = nullptr);

  explicit operator bool() const { return width_ > 0; }
  /// Bilinear, or that of the nearest pixel. False outside the image, where `radiance` stays, and if a
  /// pixel it needs is clipped: then lane 3 of `radiance` is the sum of 1, 2, 4 for the channels that are.
  bool read(float u, float v, bool nearest, Simd4& radiance) const;
  /// Prefetches pixels of row v that will be read soon.
  void prefetch(int first_u, int last_u, int v) const {
    constexpr int kLine = 64;  // bytes
    if (!pixels_) return;
    for (int u = first_u; u <= last_u; u += kLine / 3) __builtin_prefetch(pixels_ + 3 * (v * width_ + u));
  }

 private:
  static constexpr float kAllClipped = 7;

  Simd4 at(std::size_t pixel) const;

  int width_ = 0, height_ = 0;
  const std::uint8_t* pixels_ = nullptr;  ///< null if the image holds radiance
  capture::RadianceImage radiance_;
  std::array<std::array<Simd4, 256>, 3>
      table_{};  ///< by channel and pixel value; lane 3 is 2^channel for clipped values
};

[[gnu::always_inline]] inline Simd4 ColorLookup::at(std::size_t pixel) const {
  if (!pixels_) {
    const float* radiance = &radiance_.radiance.data[3 * pixel];
    return Simd4{radiance[0], radiance[1], radiance[2], radiance_.clipped.data[pixel] ? kAllClipped : 0};
  }
  const std::uint8_t* value = pixels_ + 3 * pixel;
  return table_[0][value[0]] + table_[1][value[1]] + table_[2][value[2]];
}

[[gnu::always_inline]] inline bool ColorLookup::read(float u, float v, bool nearest, Simd4& radiance) const {
  if (!(u >= 0 && v >= 0 && u < static_cast<float>(width_ - 1) && v < static_cast<float>(height_ - 1))) return false;
  const auto pixel = [&](int x, int y) {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(width_) + static_cast<std::size_t>(x);
  };
  if (nearest) {
    radiance = at(pixel(static_cast<int>(u + 0.5f), static_cast<int>(v + 0.5f)));
    return radiance[3] == 0;
  }
  const int x = static_cast<int>(u), y = static_cast<int>(v);
  const float s = u - static_cast<float>(x), t = v - static_cast<float>(y);
  const std::size_t first = pixel(x, y), below = pixel(x, y + 1);
  const Simd4 a = at(first), b = at(first + 1), c = at(below), d = at(below + 1);
  radiance = (1 - t) * ((1 - s) * a + s * b) + t * ((1 - s) * c + s * d);
  if (a[3] + b[3] + c[3] + d[3] == 0) return true;
  radiance[3] = static_cast<float>(static_cast<int>(a[3]) | static_cast<int>(b[3]) | static_cast<int>(c[3]) |
                                   static_cast<int>(d[3]));
  return false;
}

}  // namespace lumigraft::reconstruct
