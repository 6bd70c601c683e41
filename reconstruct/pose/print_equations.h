#pragma once
// Normal equations of the alignment of a print to an image, of eight pixels at a time.
#include <Eigen/Geometry>
#include <array>
#include <cstdint>
#include <vector>

#include "reconstruct/pose/gray_regions.h"
#include "reconstruct/pose/print_alignment.h"
#include "reconstruct/pose/tag.h"
#include "reconstruct/pose/tag_print.h"

namespace lumigraft::reconstruct {

/// Unknowns: rotation about the tag's centre and translation (camera frame); ink, paper, the paper's slopes; blur.
inline constexpr int kPrintUnknowns = 11;
using PrintVector = Eigen::Matrix<double, kPrintUnknowns, 1>;
using PrintMatrix = Eigen::Matrix<double, kPrintUnknowns, kPrintUnknowns>;

/// Robust least squares about one pose and appearance.
struct PrintFit {
  PrintMatrix jtj = PrintMatrix::Zero();
  PrintVector jtr = PrintVector::Zero();
  double error = 0;  ///< Σ ρ(r)
  int used = 0;      ///< pixels that are not clipped, or that contradict their lower bound
  int edges = 0, clipped_edges = 0;
};

/// Pixels are in single precision, relative to their middle: their light has 8 to 16 bits, and their places are exact
/// to 1e-6 cells. Sums are in double precision, after every 512 pixels.
class PrintEquations {
 public:
  PrintEquations(const std::vector<PixelSample>& pixels, const TagPattern& pattern, double size_m);

  /// With Huber's ρ of threshold `limit`, so that a finger or a highlight on the tag does not move it. `hold`: weight
  /// of a prior that keeps the blur near one pixel. It is needed where paper is clipped: there a wide blur of bright
  /// paper and a narrow blur of darker paper have the same dark side.
  PrintFit linearise(const Eigen::Isometry3d& pose, const PrintAppearance& appearance, double limit, double hold) const;

 private:
  /// Eight pixels, as in PixelSample; rays less `middle_`.
  struct Block {
    alignas(32) std::array<float, 8> ray_x, ray_y, u_x, u_y, v_x, v_y, light;
    std::array<std::int32_t, 8> clipped, valid;  ///< all bits set or none; the last block is not full
  };
  struct View;
  struct Totals;
  struct Pass;

  Totals sum_up(const View& view) const;
  Totals sum_up_wide(const View& view) const;

  PrintIntegral print_;
  /// Paper (1) or ink (0) of cells (i, j), (i + 1, j), (i, j + 1), (i + 1, j + 1).
  std::vector<std::array<float, 4>> corners_;
  float cells_;
  double cell_m_, half_m_;
  Eigen::Vector2d middle_ = Eigen::Vector2d::Zero();
  std::vector<Block> blocks_;
};

}  // namespace lumigraft::reconstruct
