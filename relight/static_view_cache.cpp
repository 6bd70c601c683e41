#include "relight/static_view_cache.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>

#include "relight/parameters.h"
#include "relight/passes/dispatch.h"

namespace lumigraft::relight {
namespace {

bool other_depth(float z, float before, float min_change_m) {
  // Holes are filled from the fused field, so a pixel becoming a hole or not is no change.
  return z > 0 && before > 0 && std::abs(z - before) > std::max(min_change_m, kRelight.min_depth_change * before);
}

bool other_code(int code, int before) {
  return std::abs(code - before) > std::max(kRelight.min_codes, before / kRelight.code_ratio);
}

}  // namespace

const Eigen::Isometry3d& StaticViewCache::hold(const Eigen::Isometry3d& T_tag_camera, double nearest_m, bool* moved) {
  double max_px = any_ ? 0 : 2 * kRelight.still_px;
  const Eigen::Isometry3d T_now_held = T_tag_camera.inverse() * held_;
  for (int i = 0; i < 9 && max_px <= kRelight.still_px; ++i) {
    const Eigen::Vector2d pixel(0.5 * (i % 3) * (camera_.width - 1), 0.5 * (i / 3) * (camera_.height - 1));
    const auto ray = camera_.unproject(pixel);
    if (!ray) continue;
    const auto now = camera_.project(T_now_held * (nearest_m * *ray));
    max_px = now ? std::max(max_px, (*now - pixel).norm()) : 2 * kRelight.still_px;
  }
  *moved = max_px > kRelight.still_px;
  if (*moved) held_ = T_tag_camera;
  any_ = true;
  return held_;
}

std::vector<char> StaticViewCache::changed_tiles(const capture::Image<std::uint8_t>& codes,
                                                 const capture::Image<float>* depth_m, float min_change_m, bool all) {
  const int columns = (codes.width + kTile_px - 1) / kTile_px, rows = (codes.height + kTile_px - 1) / kTile_px;
  std::vector<char> changed(static_cast<std::size_t>(columns) * rows, all);
  const std::size_t sample_columns = (codes.width + 1) / kRelight.step_px,
                    samples = sample_columns * ((codes.height + 1) / kRelight.step_px);
  const bool first = codes_.size() != samples;
  depth_m_.resize(samples);
  codes_.resize(samples);
  const auto each = [&](int column, int row, auto&& act) {
    for (int v = row * kTile_px; v < std::min((row + 1) * kTile_px, codes.height); v += kRelight.step_px) {
      std::size_t at = sample_columns * (v / kRelight.step_px) + column * kTile_px / kRelight.step_px;
      for (int u = column * kTile_px; u < std::min((column + 1) * kTile_px, codes.width); u += kRelight.step_px, ++at) {
        const std::uint8_t* c = &codes.data[codes.index(u, v)];
        act(at, std::max({c[0], c[1], c[2]}), depth_m != nullptr ? depth_m->at(u, v) : 0.0f);
      }
    }
  };
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns; ++column) {
      char& tile = changed[static_cast<std::size_t>(row) * columns + column];
      if (!all && !first) {
        int others = 0;
        each(column, row, [&](std::size_t at, int code, float z) {
          others += other_depth(z, depth_m_[at], min_change_m) || other_code(code, codes_[at]);
        });
        tile = others >= kRelight.min_changed_px;
      }
      tile = tile || first;
      if (!tile) continue;
      each(column, row, [&](std::size_t at, int code, float z) {
        depth_m_[at] = z;
        codes_[at] = static_cast<std::uint8_t>(code);
      });
    }
  }
  return changed;
}

}  // namespace lumigraft::relight
