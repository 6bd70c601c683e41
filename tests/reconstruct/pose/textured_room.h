#pragma once
// Frames of a furnished room with texture on its surfaces and no tag: colour and depth with known poses.
#include <Eigen/Geometry>
#include <cmath>
#include <cstdint>
#include <memory>

#include "tests/reconstruct/pose/pose_room.h"

namespace lumigraft::test {

/// Patches of a few centimetres with independent brightness, as on a carpet: 0.1 to 0.8.
inline float patch_albedo(const Eigen::Vector3f& p) {
  constexpr float kPatch_m = 0.035f;
  std::uint32_t hash = 2166136261u;
  for (int i = 0; i < 3; ++i) {
    // Faces of boxes are not on borders of patches.
    const auto cell = static_cast<std::int32_t>(std::floor((p[i] + 0.0113f) / kPatch_m));
    hash = (hash ^ static_cast<std::uint32_t>(cell)) * 16777619u;
  }
  hash ^= hash >> 15;
  hash *= 2246822519u;
  hash ^= hash >> 13;
  return 0.1f + 0.7f * static_cast<float>(hash & 0xffff) / 65535.0f;
}

/// Colour and depth of a room, as a camera at `T_room_camera` sees it.
inline capture::FrameSet textured_view(const reconstruct::TestRoom& room, const capture::CameraModel& camera,
                                       const Eigen::Isometry3d& T_room_camera, std::uint64_t index,
                                       double depth_noise = 1) {
  constexpr int kSamples = 2;
  capture::Frame picture;
  picture.encoded = capture::Image<std::uint8_t>(camera.width, camera.height, 3);
  const Eigen::Vector3f from = T_room_camera.translation().cast<float>();
  for (int v = 0; v < camera.height; ++v)
    for (int u = 0; u < camera.width; ++u) {
      float light = 0;
      for (int s = 0; s < kSamples * kSamples; ++s) {
        const auto ray = camera.unproject({u - 0.25 + 0.5 * (s % kSamples), v - 0.25 + 0.5 * (s / kSamples)});
        if (!ray) continue;
        const Eigen::Vector3f d = (T_room_camera.linear() * *ray).cast<float>();
        const float along = room.along(from, d);
        if (std::isfinite(along)) light += patch_albedo(from + along * d) / (kSamples * kSamples);
      }
      const long code = std::lround(255 * capture::linear_to_srgb(std::min(1.0f, light)));
      for (int c = 0; c < 3; ++c) picture.encoded.at(u, v, c) = static_cast<std::uint8_t>(code);
    }
  capture::FrameSet frame = frame_of(std::move(picture), index, static_cast<std::int64_t>(index) * kFrameNs);
  frame.depth = std::make_shared<capture::DepthFrame>(
      depth_of_room(room, camera, T_room_camera, static_cast<unsigned>(index) + 1, depth_noise));
  return frame;
}

}  // namespace lumigraft::test
