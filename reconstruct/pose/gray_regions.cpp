#include "reconstruct/pose/gray_regions.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

#include "capture/camera/radiance.h"
#include "capture/camera/srgb.h"
#include "reconstruct/pose/parameters.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Vector2d;

constexpr float kRed = 0.2126f, kGreen = 0.7152f, kBlue = 0.0722f;  // Rec. 709 luminance

float luminance(const float* rgb) { return kRed * rgb[0] + kGreen * rgb[1] + kBlue * rgb[2]; }

}  // namespace

PixelRegion region_around(const Vector2d& low, const Vector2d& high, int picture_width, int picture_height, int grid) {
  const auto side = [grid](double from, double to, int length) {
    const double begin = std::clamp(std::floor(from), 0.0, static_cast<double>(length));
    const double end = std::clamp(std::ceil(to) + 1, begin, static_cast<double>(length));
    const int first = static_cast<int>(begin) / grid * grid;
    return std::pair(first, std::min(length, (static_cast<int>(end) + grid - 1) / grid * grid) - first);
  };
  PixelRegion region;
  std::tie(region.left, region.width) = side(low.x(), high.x(), picture_width);
  std::tie(region.top, region.height) = side(low.y(), high.y(), picture_height);
  return region;
}

PixelRegion region_of_print(const TagCorners& corners, const TagPattern& pattern, int picture_width,
                            int picture_height) {
  const Eigen::AlignedBox2d box = box_of(corners);
  const Vector2d margin = box.sizes() / pattern.square_cells + Vector2d::Constant(3);
  return region_around(box.min() - margin, box.max() + margin, picture_width, picture_height);
}

float detector_gain(const capture::Image<float>& radiance) {
  std::vector<float> sorted(radiance.data.size() / 3);
  if (sorted.empty()) return 1.0f;
  for (std::size_t i = 0; i < sorted.size(); ++i) sorted[i] = luminance(&radiance.data[3 * i]);
  const auto bright = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() * 95 / 100);
  std::nth_element(sorted.begin(), bright, sorted.end());
  return *bright > 0 ? 0.9f / *bright : 1.0f;
}

capture::Image<std::uint8_t> detector_codes(const capture::Frame& picture, const PixelRegion& region, float gain) {
  capture::Image<std::uint8_t> codes(region.width, region.height, 1);
  for (int y = 0; y < region.height; ++y) {
    std::uint8_t* row = &codes.data[codes.index(0, y)];
    if (!picture.encoded.empty()) {
      const std::uint8_t* rgb = &picture.encoded.data[picture.encoded.index(region.left, region.top + y)];
      for (int x = 0; x < region.width; ++x, rgb += 3)
        row[x] = static_cast<std::uint8_t>((54 * rgb[0] + 183 * rgb[1] + 19 * rgb[2]) >> 8);
    } else {
      const float* rgb = &picture.radiance.data[picture.radiance.index(region.left, region.top + y)];
      for (int x = 0; x < region.width; ++x, rgb += 3) row[x] = capture::srgb_table().code(gain * luminance(rgb));
    }
  }
  return codes;
}

std::vector<PixelSample> sample_pixels(const capture::Frame& picture, const capture::Response& response,
                                       const capture::CameraModel& camera, const PixelRegion& region,
                                       const ImageMotion& motion) {
  constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
  std::vector<Vector2d> rays;
  rays.reserve(static_cast<std::size_t>(region.width) * region.height);
  for (int v = region.top; v < region.top + region.height; ++v)
    for (int u = region.left; u < region.left + region.width; ++u) {
      const auto direction = camera.unproject(motion.at_row_time({static_cast<double>(u), static_cast<double>(v)}));
      rays.push_back(direction && direction->z() > 0 ? Vector2d(direction->head<2>() / direction->z())
                                                     : Vector2d(kNaN, kNaN));
    }
  std::vector<PixelSample> pixels;
  pixels.reserve(rays.size());
  for (int y = 1; y + 1 < region.height; ++y)
    for (int x = 1; x + 1 < region.width; ++x) {
      const std::size_t i = static_cast<std::size_t>(y) * region.width + x;
      PixelSample pixel;
      pixel.u = region.left + x;
      pixel.v = region.top + y;
      pixel.ray = rays[i];
      pixel.ray_by_u = (rays[i + 1] - rays[i - 1]) / 2;
      pixel.ray_by_v = (rays[i + region.width] - rays[i - region.width]) / 2;
      if (!(pixel.ray + pixel.ray_by_u + pixel.ray_by_v).allFinite()) continue;
      if (!picture.encoded.empty()) {
        const std::uint8_t* rgb = &picture.encoded.data[picture.encoded.index(pixel.u, pixel.v)];
        float linear[3];
        for (int c = 0; c < 3; ++c) {
          linear[c] = response.to_linear(std::min(rgb[c], capture::kFullScale), c);
          pixel.clipped = pixel.clipped || rgb[c] >= capture::kFullScale;
        }
        pixel.light = luminance(linear);
      } else {
        pixel.light = luminance(&picture.radiance.data[picture.radiance.index(pixel.u, pixel.v)]);
      }
      pixels.push_back(pixel);
    }
  return pixels;
}

std::vector<PixelSample> thin_out(const std::vector<PixelSample>& pixels) {
  // Points of these lattices are a knight's move apart, so that all rows and columns have equally many.
  const bool many = pixels.size() > kPrintAlignment.many_pixels;
  std::vector<PixelSample> few;
  for (const PixelSample& pixel : pixels)
    if (many ? (pixel.u + 5 * pixel.v) % 13 == 0 : (pixel.u + 2 * pixel.v) % 5 == 0) few.push_back(pixel);
  return few;
}

}  // namespace lumigraft::reconstruct
