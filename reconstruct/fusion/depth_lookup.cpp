#include "reconstruct/fusion/depth_lookup.h"

#include <algorithm>

#include "reconstruct/fusion/depth_noise.h"

namespace lumigraft::reconstruct {
namespace {

constexpr float kBesideVoxels = 2;  // so close to a jump, what one surface hides of the other is filled in
constexpr float kRimSlack = 0.75f;  // of a voxel
constexpr float kDeepVoxels = 3,
                kDeepShare = 1.02f;    // farther than a plane is ever off from a pixel that it is seen at
constexpr float kMatchSlope = 2;       // tan of how much a plane may turn on from one block to the next
constexpr float kSteadyVoxels = 0.4f;  // noise beyond it tilts planes too much to carry them on
constexpr float kSurelyNoise = 3;      // σ

}  // namespace

Reading DepthReader::near_jump(const Eigen::Vector3f& p, int u, int v, const PreparedDepth::Block& block) const {
  const std::int32_t pixel = view_.pixel_index(u, v);
  const float inverse_depth = view_.inverse_depth[static_cast<std::size_t>(pixel)];
  const PreparedDepth::Jump& jump = view_.jumps[static_cast<std::size_t>(block.jump)];
  if (inverse_depth == 0) return {};
  const bool near_side = inverse_depth > jump.divide;
  const float away = (jump.pixel - Eigen::Vector2f(static_cast<float>(u), static_cast<float>(v))).norm();
  const bool beside = jump.far >= 0 && away < kBesideVoxels * jump.voxel_pixels + 1;
  // Deep behind what is seen here nothing is told, but of the far surface that goes on there.
  if (!(near_side && beside) &&
      (p.z() - kBehindSteep * truncation_m_ - kDeepVoxels * voxel_m_) * inverse_depth > kDeepShare)
    return {};

  Reading reading;
  const PreparedDepth::Block* plane = block.weight > 0 ? &block : plane_through(u, v);
  if (plane) {
    float distance_m = plane->distance_m;
    if (plane != &block) distance_m = 0.5f * (distance_m + plane->normal.dot(surface(pixel)));
    reading = from_plane(p, *plane, distance_m);
    if (plane != &block) {
      reading.edge = true;
      reading.weight *= kEdgeTrust;
    }
    // Behind its rim a surface is solid only where it stands: else the line of sight would grow fins past the rim.
    if (near_side && reading.weight > 0 && reading.distance_m < 0) {
      const bool at_rim = away < kRimVoxels * jump.voxel_pixels + 1;
      if ((at_rim && reading.distance_m < -shell_m_) ||
          !stands(p + reading.distance_m * plane->normal, jump, *plane, distance_m))
        reading.weight = 0;
    }
  }
  if (!beside) return reading;
  if (near_side) {
    if (reading.weight <= 0) return hidden(p, jump.far);
  } else if (reading.weight > 0) {
    // Free of the far surface, but the near one's rim is beside.
    reading.distance_m = std::min(reading.distance_m, (p - surface(jump.near)).norm());
  }
  return reading;
}

/// A voxel that the camera just misses belongs to cells that it sees: surfaces go on as planes for a little.
Reading DepthReader::beyond_picture(const Eigen::Vector3f& p, const Eigen::Vector2f& pixel) const {
  const float last_u = static_cast<float>(view_.width - 1), last_v = static_cast<float>(view_.height - 1);
  if (p.z() > beyond_to_m()) return {};
  const Eigen::Vector2f nearest(std::clamp(pixel.x(), 0.0f, last_u), std::clamp(pixel.y(), 0.0f, last_v));
  const float away = (pixel - nearest).cwiseAbs().maxCoeff();
  if (!(away < beyond_to_pixels())) return {};
  const int u = static_cast<int>(nearest.x() + 0.5f), v = static_cast<int>(nearest.y() + 0.5f);
  const float inverse_depth = view_.inverse_depth[static_cast<std::size_t>(view_.pixel_index(u, v))];
  const PreparedDepth::Block& block = view_.block_of(u, v);
  if (block.weight <= 0 || block.jump >= 0 || inverse_depth == 0 || !(inverse_depth * steady_to_m_ > 1) ||
      away > kRimVoxels * voxel_m_ * preparation_.focal() * inverse_depth + 1)
    return {};
  Reading reading = from_plane(p, block, block.distance_m);
  if (std::abs(reading.distance_m) > shell_m_) return {};
  reading.weight *= kEdgeTrust;
  reading.in_sight = false;
  return reading;
}

/// Just behind a rim the farther surface goes on: cells that the camera sees need that voxel.
Reading DepthReader::hidden(const Eigen::Vector3f& p, std::int32_t behind) const {
  const float inverse_depth = view_.inverse_depth[static_cast<std::size_t>(behind)];
  const int u = behind % view_.width, v = behind / view_.width;
  const PreparedDepth::Block& own = view_.block_of(u, v);
  const PreparedDepth::Block* plane = own.weight > 0 ? &own : plane_through(u, v);
  Reading reading;
  if (!plane || !(inverse_depth * steady_to_m_ > 1)) return reading;
  const float distance_m = plane->distance_m - plane->normal.dot(p);
  if (std::abs(distance_m) > shell_m_) return reading;
  reading.distance_m = distance_m;
  reading.weight = kEdgeTrust * plane->weight;
  reading.normal = plane->normal;
  reading.in_sight = false;
  return reading;
}

/// Whether the camera sees the plane at this place of it, or within a voxel of it: a cell that the rim passes through
/// needs a corner behind the surface.
bool DepthReader::stands(const Eigen::Vector3f& foot, const PreparedDepth::Jump& jump,
                         const PreparedDepth::Block& block, float distance_m) const {
  if (!(foot.z() > 0)) return false;
  const Eigen::Vector2f pixel = map_.pixel(foot.x() / foot.z(), foot.y() / foot.z());
  const Eigen::Vector2f inside(static_cast<float>(jump.near % view_.width) - jump.pixel.x(),
                               static_cast<float>(jump.near / view_.width) - jump.pixel.y());
  return seen_at(pixel, block, distance_m) ||
         seen_at(pixel + kRimSlack * jump.voxel_pixels * inside.normalized(), block, distance_m);
}

bool DepthReader::seen_at(const Eigen::Vector2f& pixel, const PreparedDepth::Block& block, float distance_m) const {
  const float x = pixel.x() + 0.5f, y = pixel.y() + 0.5f;
  // Nothing is known beyond the picture.
  if (!(x >= 0 && y >= 0 && x < static_cast<float>(view_.width) && y < static_cast<float>(view_.height))) return true;
  const std::int32_t at = view_.pixel_index(static_cast<int>(x), static_cast<int>(y));
  const float inverse_depth = view_.inverse_depth[static_cast<std::size_t>(at)];
  if (inverse_depth == 0) return false;
  const float off = block.normal.dot(surface(at)) - distance_m;
  return std::abs(off) < 0.5f * voxel_m_ + kSurelyNoise * straight_sigma_m(inverse_depth);
}

/// Of the blocks around, the plane that a pixel beside a jump lies on; null for one that lies between surfaces.
const PreparedDepth::Block* DepthReader::plane_through(int u, int v) const {
  const std::int32_t pixel = view_.pixel_index(u, v);
  std::int32_t& found = view_.plane_through[static_cast<std::size_t>(pixel)];
  if (found == PreparedDepth::kNotAsked) {
    found = find_plane_through(u, v);
    view_.asked.push_back(pixel);
  }
  return found < 0 ? nullptr : &view_.blocks[static_cast<std::size_t>(found)];
}

/// Place of its block; −1 for none.
std::int32_t DepthReader::find_plane_through(int u, int v) const {
  const std::int32_t pixel = view_.pixel_index(u, v);
  const float inverse_depth = view_.inverse_depth[static_cast<std::size_t>(pixel)];
  const Eigen::Vector3f ray = preparation_.ray(pixel).homogeneous();
  float least = inverse_depth * (kMatchSlope * 2 / preparation_.focal() +
                                 kSurelyNoise * straight_sigma_m(inverse_depth) * inverse_depth);
  std::int32_t best = -1;
  for (int y = std::max((v >> 1) - 1, 0); y <= std::min((v >> 1) + 1, view_.blocks_y - 1); ++y)
    for (int x = std::max((u >> 1) - 1, 0); x <= std::min((u >> 1) + 1, view_.blocks_x - 1); ++x) {
      const std::int32_t at = y * view_.blocks_x + x;
      const PreparedDepth::Block& block = view_.blocks[static_cast<std::size_t>(at)];
      if (block.weight <= 0) continue;
      const float off = std::abs(block.normal.dot(ray) / block.distance_m - inverse_depth);
      if (off >= least) continue;
      least = off;
      best = at;
    }
  return best;
}

/// Farther off noise would tilt it.
float DepthReader::steady_to_m() const {
  const float sigma_m = kSteadyVoxels * voxel_m_ / std::max(view_.noise_scale, 1e-6f);
  return farthest_m(sigma_m);
}

}  // namespace lumigraft::reconstruct
