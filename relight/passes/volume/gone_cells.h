#pragma once
// Surface of the volumes that is gone, and what is behind it, for shadow cones: they pass it. In: cells, found on the
// host. Out: binding().
#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <vector>

#include "relight/gpu/device.h"
#include "relight/shaders/common/interop.h"

namespace lumigraft::relight {

/// Cells of a regular grid that contain such surface.
struct GoneGrid {
  Eigen::Vector3f low_m = Eigen::Vector3f::Zero();  ///< corner of the first cell, tag frame
  float cell_m = 0;                                 ///< edge; 0: nothing is gone
  Eigen::Vector3i size = Eigen::Vector3i::Zero();
  std::vector<std::uint32_t> bits = {};  ///< 32 cells each, x fastest

  void set(const Eigen::Vector3i& cell) {
    const int i = cell.x() + size.x() * (cell.y() + size.y() * cell.z());
    bits[static_cast<std::size_t>(i >> 5)] |= 1u << (i & 31);
  }
  bool operator==(const GoneGrid&) const = default;
};

class GoneCells {
 public:
  /// For grids of at most `max_cells` cells.
  GoneCells(gpu::Device& device, int max_cells);

  /// Uploads the grid and describes it in `params`.
  void take(gpu::Device& device, GoneGrid grid, shader::FrameParams& params);
  /// Whether the last two grids differ.
  bool changed() const { return changed_; }
  /// As declared in volume.glsl.
  const gpu::Buffer& buffer() const { return *bits_; }

 private:
  GoneGrid grid_;
  bool changed_ = false;
  int grids_ = 0;
  std::unique_ptr<gpu::Buffer> bits_;
};

}  // namespace lumigraft::relight
