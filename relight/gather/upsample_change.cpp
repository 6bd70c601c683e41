#include "relight/gather/upsample_change.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "relight/gather/parameters.h"
#include "relight/tracing/fast_exp.h"
#include "relight/tracing/parallel_for.h"

namespace lumigraft::relight {
namespace {

class Upsampler {
 public:
  Upsampler(const LowResChange& low, const CameraRays& eye, const CurrentDepth& depth, const CameraUpload& picture,
            FullChange& full)
      : low_(low),
        eye_(eye),
        depth_(depth),
        picture_(picture),
        full_(full),
        eye_m_(eye.camera.T_tag_camera.translation()),
        step_(1 / (255 * picture.exposure().maxCoeff())) {}

  void pixel(int u, int v) const {
    const std::array<Corner, 4> corners = around(u, v);
    const auto i = static_cast<std::size_t>(v * eye_.camera.model.width + u);
    Rgb radiance = picture_.radiance(i), least = at(low_.change, corners[0]), most = least;
    for (const Corner& corner : corners) {
      const Rgb change = at(low_.change, corner);
      least = least.min(change);
      most = most.max(change);
    }
    const bool clips = picture_.clipped(i);
    // Equal changes are not those of textured surfaces, whose ratios are equal.
    if ((least == 0).all() && (most == 0).all() && !clips) {
      set_at(full_.radiance, i, radiance);
      return;
    }
    const std::array<float, 4> weight =
        weights(u, v, corners, (most - least).maxCoeff() < kGather.visible_codes * step_);
    Rgb ratio = Rgb::Zero(), added = Rgb::Zero(), restored = Rgb::Zero();
    for (std::size_t k = 0; k < 4; ++k) {
      const Rgb change = at(low_.change, corners[k]), under = at(low_.radiance, corners[k]);
      restored += weight[k] * under;
      const bool in_proportion = !low_.seen[corners[k].pixel].glossy;
      for (int c = 0; c < 3; ++c) {
        if (in_proportion && under[c] > step_)
          ratio[c] += weight[k] * change[c] / under[c];
        else
          added[c] += weight[k] * change[c];
      }
    }
    for (std::size_t c = 0; clips && c < 3; ++c) {
      const auto channel = static_cast<Eigen::Index>(c);
      if (picture_.clipped(i, c)) radiance[channel] = std::max(radiance[channel], restored[channel]);
    }
    set_at(full_.radiance, i, radiance);
    set_at(full_.change, i, ratio * radiance + added);
  }

 private:
  struct Corner {
    std::size_t pixel = 0;  ///< of low_
    float weight = 0;       ///< bilinear
  };

  std::array<Corner, 4> around(int u, int v) const {
    const float to_middle = 0.5f * static_cast<float>(low_.scale - 1), edge = static_cast<float>(low_.scale);
    const float x = (static_cast<float>(u) - to_middle) / edge, y = (static_cast<float>(v) - to_middle) / edge;
    const int left = std::clamp(static_cast<int>(std::floor(x)), 0, std::max(low_.width - 2, 0)),
              top = std::clamp(static_cast<int>(std::floor(y)), 0, std::max(low_.height - 2, 0));
    const float right = std::clamp(x - static_cast<float>(left), 0.0f, 1.0f),
                down = std::clamp(y - static_cast<float>(top), 0.0f, 1.0f);
    std::array<Corner, 4> corners;
    for (int k = 0; k < 4; ++k) {
      const int i = std::min(left + (k & 1), low_.width - 1), j = std::min(top + (k >> 1), low_.height - 1);
      corners[static_cast<std::size_t>(k)] = {static_cast<std::size_t>(j * low_.width + i),
                                              (k & 1 ? right : 1 - right) * (k >> 1 ? down : 1 - down)};
    }
    return corners;
  }

  /// Their sum is 1. `alike`: it makes no visible difference which count.
  std::array<float, 4> weights(int u, int v, const std::array<Corner, 4>& corners, bool alike) const {
    std::array<float, 4> weight;
    float sum = 0;
    const float depth_m = alike ? 0 : depth_.at(u, v);
    for (std::size_t k = 0; k < 4; ++k) {
      weight[k] = corners[k].weight;
      if (depth_m > 0)
        weight[k] =
            (weight[k] + kGather.block_unlike) * (goes_through(u, v, depth_m, corners[k]) + kGather.block_unlike);
      sum += weight[k];
    }
    for (float& w : weight) w /= sum;
    return weight;
  }

  /// How well the plane of a pixel's surface explains the depth at (u, v).
  float goes_through(int u, int v, float depth_m, const Corner& corner) const {
    const GBufferPixel& p = low_.seen[corner.pixel];
    if (!p.known) return 0;
    const Eigen::Vector3f point_m = eye_m_ + depth_m * eye_.ray(u, v);
    const float off = p.surface.normal.dot(point_m - p.surface.position_m) / depth_.allowed_m(depth_m);
    return fast_exp(off * off);
  }

  static Rgb at(const capture::Image<float>& image, const Corner& corner) { return radiance_at(image, corner.pixel); }

  const LowResChange& low_;
  const CameraRays& eye_;
  const CurrentDepth& depth_;
  const CameraUpload& picture_;
  FullChange& full_;
  Eigen::Vector3f eye_m_;
  float step_;  ///< radiance of one of 255 equal steps to the white of the picture, W/sr/m²
};

}  // namespace

void upsample(const LowResChange& low, const CameraRays& eye, const CurrentDepth& depth, const CameraUpload& picture,
              FullChange& full) {
  const capture::CameraModel& model = eye.camera.model;
  full.change = full.radiance = capture::Image<float>(model.width, model.height, 3);
  const Upsampler upsampler(low, eye, depth, picture, full);
  for_each_index(model.height, kRows, [&](int v) {
    const int edge = low.scale * TileMask::kEdge;
    for (int x = 0; x < low.tiles.across(); ++x) {
      if (!low.tiles.tile(x, v / edge)) continue;
      for (int u = x * edge; u < std::min((x + 1) * edge, model.width); ++u) upsampler.pixel(u, v);
    }
  });
}

}  // namespace lumigraft::relight
