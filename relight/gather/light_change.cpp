#include "relight/gather/light_change.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <opencv2/imgproc.hpp>

#include "reconstruct/math/median.h"
#include "relight/gather/parameters.h"

namespace lumigraft::relight {
namespace {

using Code = cv::Vec<std::uint8_t, 3>;
using Logs = cv::Vec3f;

/// Codes are logarithms of the ratio in steps of 1.2 %: of 8 bits, whose median is fast. 135: no change.
constexpr float kLogStep = 0.012f;
/// Blocks of pixels in which the light on a covered surface is computed once.
constexpr int kSameCode = 135, kCovered = 4;

std::uint8_t code_of(float log_ratio) {
  return cv::saturate_cast<std::uint8_t>(log_ratio / kLogStep + static_cast<float>(kSameCode));
}

/// Width of the window of the median, pixels; odd. One of `step` pixels is enough to find it.
int window_px(const PosedCamera& camera, float voxel_m, const std::vector<GBufferPixel>& seen, std::size_t step) {
  std::vector<float> depths_m;
  for (std::size_t i = 0; i < seen.size(); i += step) {
    if (seen[i].known) depths_m.push_back(seen[i].depth_m);
  }
  if (depths_m.empty()) return 1;
  const float middle_m = reconstruct::median(depths_m);
  const float voxel_px =
      voxel_m * static_cast<float>(camera.model.fx) / std::max(middle_m, static_cast<float>(kGather.min_nearest_m));
  const float reach_px = std::min(kGather.light_reach * voxel_px, static_cast<float>(kGather.light_max_px));
  return 2 * std::max(static_cast<int>(std::lround(reach_px)), 1) + 1;
}

}  // namespace

LightChange::LightChange(const PosedCamera& camera, const CurrentDepth& depth, const CameraUpload& picture,
                         float voxel_m, const std::vector<GBufferPixel>& seen, const TilePixels* tiles)
    : camera_(camera),
      T_camera_tag_(camera.T_tag_camera.inverse()),
      near_m_(2 * voxel_m),
      far_m_(seen.size(), 0.0f),
      codes_(3 * seen.size(), kSameCode) {
  for (int code = 0; code < 256; ++code) {
    const float change = kLogStep * static_cast<float>(code - kSameCode);
    const float certain = std::copysign(std::max(std::abs(change) - kGather.light_same, 0.0f), change);
    ratios_[static_cast<std::size_t>(code)] = std::exp(certain);
  }
  const int width = camera.model.width, height = camera.model.height;
  cv::Mat_<Logs> logs(height, width, Logs(0, 0, 0));
  cv::Mat1f weight(height, width, 0.0f);
  const auto add = [&](int u, int v) {
    const auto i = static_cast<std::size_t>(v * width + u);
    const bool traced = !tiles || !seen[i].w.isZero(0);
    const GBufferPixel& p = traced ? seen[i] : tiles->at(u, v);
    if (!p.known || p.glossy) return;
    // The frame's depth is that of the room in tiles that nothing moved in.
    far_m_[i] = traced || !depth.known(u, v) ? p.depth_m : depth.at(u, v);
    if (!(traced || TilePixels::has(u, v, camera.model))) return;
    if (!(p.before.minCoeff() > 0) || picture.clipped(i) || depth.differs(u, v, p.depth_m)) return;
    const Rgb ratio = detail_of(picture.radiance(i), p.before);
    logs(v, u) = Logs(std::log(ratio[0]), std::log(ratio[1]), std::log(ratio[2]));
    weight(v, u) = 1;
  };
  for_each_pixel(width, height, kRows, add);
  const int window = tiles ? window_px(camera, voxel_m, tiles->seen, 1) : window_px(camera, voxel_m, seen, 61);
  // The mean of a few pixels, as fine texture may have two values only.
  const int few = window / 6 * 2 + 1;
  cv::Mat_<Logs> sums, few_logs;
  cv::Mat1f sum, few_weight;
  cv::boxFilter(logs, sums, -1, {window, window}, {-1, -1}, false);
  cv::boxFilter(weight, sum, -1, {window, window}, {-1, -1}, false);
  cv::boxFilter(logs, few_logs, -1, {few, few}, {-1, -1}, false);
  cv::boxFilter(weight, few_weight, -1, {few, few}, {-1, -1}, false);
  cv::Mat_<Code> codes(height, width, reinterpret_cast<Code*>(codes_.data()));
  for_each_pixel(width, height, kRows, [&](int u, int v) {
    const Logs log = weight(v, u) > 0 ? few_logs(v, u) / few_weight(v, u) : sums(v, u) / std::max(sum(v, u), 1.0f);
    for (int c = 0; c < 3; ++c) codes(v, u)[c] = code_of(log[c]);
  });
  cv::medianBlur(codes.clone(), codes, window);
  any_ = std::any_of(codes_.begin(), codes_.end(), [&](std::uint8_t code) { return ratios_[code] != 1; });
}

Rgb LightChange::of_pixel(std::size_t i) const {
  return {ratios_[codes_[3 * i]], ratios_[codes_[3 * i + 1]], ratios_[codes_[3 * i + 2]]};
}

void LightChange::exclude_from(std::vector<GBufferPixel>& seen, const capture::Image<float>& radiance) const {
  if (!any_) return;
  for_each_pixel(radiance.width, radiance.height, kRows, [&](int u, int v) {
    const Rgb change = of_pixel(pixel_at(u, v));
    if ((change == 1).all()) return;
    const auto i = static_cast<std::size_t>(v * radiance.width + u);
    GBufferPixel& p = seen[i];
    if (!p.known || p.glossy) return;
    p.albedo = detailed(p.surface.bsdf.diffuse / change, radiance_at(radiance, i), p.before);
  });
}

void LightChange::predict(const RayRoom& room, const std::vector<LightSampleSet>& lamps, const MovedOccluders& moved,
                          const MovedPixels& covered) {
  const int width = camera_.model.width;
  // Computed for one covered pixel of each block, and used for all of it.
  std::vector<std::size_t> first(covered.size());
  std::vector<std::size_t> of_block(((static_cast<std::size_t>(width) + kCovered - 1) / kCovered) *
                                        ((static_cast<std::size_t>(camera_.model.height) + kCovered - 1) / kCovered),
                                    covered.size());
  for (std::size_t k = 0; k < covered.size(); ++k) {
    const int u = static_cast<int>(covered[k].first) % width, v = static_cast<int>(covered[k].first) / width;
    std::size_t& block =
        of_block[static_cast<std::size_t>(v / kCovered * ((width + kCovered - 1) / kCovered) + u / kCovered)];
    block = std::min(block, k);
    first[k] = block;
  }
  std::vector<Rgb> ratio(covered.size(), Rgb::Ones());
  for_each_index(covered.size(), kRows * kCovered, [&](std::size_t k) {
    const GBufferPixel& p = covered[k].second;
    if (first[k] != k || !p.known || p.glossy) return;
    const Rgb all = unoccluded_irradiance(*room.illumination(), lamps, p.surface);
    Rgb fused = all, now = all;
    for (const LightSampleSet& lamp : lamps) {
      const ShadowRayPacket fan = lamp.from(p.surface, static_cast<int>(k) % LightSampleSet::kSets);
      if (!(fan.all > 0)) continue;
      const std::uint32_t by_room = room.meshes().blocked(fan.rays),
                          by_all = moved.blocked(room.meshes(), fan.rays, by_room);
      for (std::size_t ray = 0; ray < RayFan::kMaxRays; ++ray) {
        const Rgb light = fan.weight[ray] * lamp.lamp().radiance;
        if (by_room >> ray & 1) fused -= light;
        if (by_all >> ray & 1) now -= light;
      }
    }
    ratio[k] = (now.max(0.0f) + 1e-3f * all) / (fused.max(0.0f) + 1e-3f * all).max(1e-9f);
  });
  for (std::size_t k = 0; k < covered.size(); ++k) {
    for (std::size_t c = 0; c < 3; ++c) {
      std::uint8_t& code = codes_[3 * covered[k].first + c];
      code = code_of(std::log(ratio[first[k]][static_cast<Eigen::Index>(c)]));
      any_ = any_ || ratios_[code] != 1;
    }
  }
}

Eigen::Array4f LightChange::lamps_now(const std::vector<LightSampleSet>& lamps, const GBufferPixel& pixel) const {
  Eigen::Array4f bound = Eigen::Array4f::Constant(std::numeric_limits<float>::infinity());
  if (!(pixel.before.minCoeff() > 0)) return bound;
  const Rgb now = at(pixel.surface.position_m);
  if ((now >= 1).all()) return bound;
  Rgb of_lamps = Rgb::Zero();
  for (const LightSampleSet& lamp : lamps) of_lamps += lamp.unhidden(pixel.surface) * lamp.lamp().radiance;
  const Rgb fused = kPi * pixel.before / pixel.surface.bsdf.diffuse.max(1e-3f), gone = (1 - now).max(0) * fused;
  for (int c = 0; c < 3; ++c) {
    if (gone[c] > 0) bound[c] = std::max(of_lamps[c] - gone[c], 0.0f);
  }
  return bound;
}

Rgb LightChange::at(const Eigen::Vector3f& p_m) const {
  const Eigen::Vector3f p = T_camera_tag_ * p_m;
  if (!(p.z() > 0)) return Rgb::Ones();
  const auto pixel = camera_.model.project(p.cast<double>());
  if (!pixel || !camera_.model.inside(*pixel)) return Rgb::Ones();
  const auto u = static_cast<int>(std::lround(pixel->x())), v = static_cast<int>(std::lround(pixel->y()));
  const auto i = static_cast<std::size_t>(v * camera_.model.width + u);
  if (!(far_m_[i] > 0) || std::abs(p.norm() - far_m_[i]) > near_m_ + kCompose.moved_jump * far_m_[i])
    return Rgb::Ones();
  return of_pixel(pixel_at(u, v));
}

}  // namespace lumigraft::relight
