#pragma once
// Numbers that decide something here. Where no reason is given the value was chosen by hand and not swept.

#include <cstddef>

namespace lumigraft::relight {
inline constexpr struct UploadParameters {
  double max_bricks = 2e6;              ///< entries of the dense index: 40 MB including clearances
  float far_m = 10, min_image = 2e-3f;  ///< clearances; a mirror's part of all lamps' light: less is not visible
  float min_radius_m = 1e-3f, min_rad = 1e-3f, max_rad = 1;  ///< of point lamps: radius; angular radius
  float unknown_distance_m = 100;  ///< of a lamp: far enough that parallax across a room is below a degree
  int environment_px = 128, environment_mips = 6, field_voxels = 128;  ///< edge; a model's longest edge
  int posed_field_voxels =
      64;                    ///< likewise, of an animated model in each pose: as a usual volume has around one object
  int animation_poses = 64;  ///< of an animation, to find its extent
  int samples = 60000;       ///< of a surface: the area of one is below a voxel face of the finest usual volume
  int rough_triangles = 2000, simple_triangles = 9000;  ///< the vertex stage of software devices is serial
  std::size_t frame_bytes = 8 << 20;                    ///< of models, uploaded per frame: 3 ms at 3 GB/s
  int even_triangles = 1500;  ///< light is stored per vertex: no edge is longer than those of so many equal triangles
} kUpload;
}  // namespace lumigraft::relight
