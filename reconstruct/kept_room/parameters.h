#pragma once
// Numbers that decide something in this folder.
#include <cstddef>
#include <cstdint>

namespace lumigraft::reconstruct {

struct KeptRoomParameters {
  /// Comparison of the kept room with what the camera sees (room_check).
  struct Check {
    int points = 1200;                       ///< of depth in one look: 10 to 30 ms
    float noise_sigmas = 3;                  ///< of depth, up to which a point is on a surface of the room,
                                             ///< besides the truncation distance, within which fusion averages
    float near_plane_m = 0.03f;              ///< of the tag's plane, which is around a tag in every room
    float near_m = 0.05f, far_m = 12;        ///< of rays; depth beyond is not fused
    int min_points = 100;                    ///< that meet the room, a twelfth of the image, to say anything
    float min_fraction = 0.5f;               ///< of them on its surfaces, in the same room: most of it has not moved
    std::int64_t interval_ns = 500'000'000;  ///< between looks
    int max_contradictions = 20;  ///< looks, 10 s: a visitor who stands in front of the camera goes on meanwhile
    int max_looks = 60;           ///< 30 s without enough points, after which a warning says so
  } check;

  /// Storage (brick_codec, room_file). Distances have a noise of 0.15 mm after 64 measurements of 1.2 mm; a step of
  /// 0.03 mm (of 32 mm) adds a fiftieth of its variance.
  struct File {
    int distance_steps = 1024;       ///< of the truncation distance
    int albedo_steps = 4096;         ///< of an albedo of 1, and of its sigma: a tenth of the least visible change
    std::size_t chunk_bricks = 256;  ///< that share a checksum: 0.5 MB, a millisecond to check
    std::size_t max_bricks = std::size_t{1} << 23;  ///< of one kind: 1 TB, the largest memory of fusion, holds as many
    int max_coordinate = 1 << 20;                   ///< of a brick: 67 km
  } file;
};
inline constexpr KeptRoomParameters kKeptRoom;

}  // namespace lumigraft::reconstruct
