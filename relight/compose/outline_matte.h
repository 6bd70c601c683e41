#pragma once
// Alpha of pixels at the outline of a foreground that depth shows: C = α F + (1 - α) B (Chuang et al. 2001), as in
// foreground_matte.h.
#include <array>
#include <memory>
#include <opencv2/core.hpp>
#include <vector>

#include "reconstruct/math/simd4.h"
#include "relight/compose/outline_distance.h"
#include "relight/compose/outline_lag.h"
#include "relight/compose/rgb_image.h"
#include "relight/passes/screen/camera_upload.h"

namespace lumigraft::relight {

/// How far pixels around objects are needed, and from how far their colours are taken, for an image of this width.
struct MatteReach {
  explicit MatteReach(int width);
  float sigma_px;  ///< of an outline's place in depth
  int matte_px, samples_px;
};

class OutlineMatte {
  using Simd4 = reconstruct::Simd4;
  /// Weighted sums over the samples of one side, by channel.
  struct Side {
    Simd4 colors{}, squares{}, values{};  ///< colors, squares: the sum of weights last
  };
  struct Sides {
    Side front, behind;
  };

 public:
  /// `away`: from the foreground's outline, exact up to MatteReach::samples_px, in the window of the image at `corner`.
  /// `values`: of the image's size, three channels; null: none. All remain referenced.
  OutlineMatte(const DisplacedDepth& depth, const CameraUpload& picture, const cv::Point& corner,
               const OutlineDistance& away, const capture::Image<float>* values = nullptr);

  /// Whether pixel (u, v) of the image, within the window, is near enough to the outline to be a mixture.
  bool reaches(int u, int v) const { return reaches(u, v, away_.at(u - corner_.x, v - corner_.y)); }
  bool reaches(int u, int v, float away_px) const {
    const float px = std::abs(away_px);
    return px <= static_cast<float>(reach_.matte_px) ||
           (px <= static_cast<float>(reach_.samples_px) && !depth_.known(u, v));
  }

  /// Whether depth shows the foreground at a pixel that is not near its outline.
  bool is_front(int u, int v) const {
    return away_.at(u - corner_.x, v - corner_.y) < -static_cast<float>(reach_.matte_px) && depth_.known(u, v);
  }

  /// Finds the colours of both sides around these pixels of the image, before at() for them.
  void prepare(const std::vector<cv::Point>& pixels);

  /// Colours and values have three channels; the last lane has no meaning.
  struct Mixture {
    float foreground;                       ///< α
    reconstruct::Simd4 own, front, behind;  ///< the colours of the pixel, of the foreground, and of what is behind it
    /// Both sides are near; else α is that of depth, or without it of the colours of the side that is, and the colours
    /// are the pixel's.
    bool both = false;
    bool in_front = false;                               ///< depth shows the foreground at the pixel
    reconstruct::Simd4 values_front{}, values_behind{};  ///< means of `values` on both sides, if both are near
  };
  /// Mixtures of pixels one after the other; neighbours of a row share work. For one thread.
  class Reader {
   public:
    explicit Reader(const OutlineMatte& matte) : matte_(matte) {}
    Mixture at(int u, int v);

   private:
    const OutlineMatte& matte_;
    int column_ = -1, row_ = -1, v_ = -1;  ///< of what is known: the nodes around a pixel, and its row
    Sides left_, right_;                   ///< sums between nodes above and below
  };

 private:
  std::size_t index(int column, int row) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) + static_cast<std::size_t>(column);
  }
  /// The nodes around a pixel, the first at (column, row), and its place between them, 0 to 1.
  struct Place {
    int column, row;
    float right, below;
  };
  Place place_of(int u, int v) const;
  void sum_samples(int column, int row);
  template <bool kValues>
  Sides gathered(int column, int row) const;
  Sides between(const Sides& a, const Sides& b, float towards_b) const;
  Mixture mixture(int u, int v, const Sides& sums) const;

  DisplacedDepth depth_;
  const CameraUpload& picture_;
  int width_;  ///< of the image
  MatteReach reach_;
  cv::Point corner_;
  const OutlineDistance& away_;
  const capture::Image<float>* values_;

  // Colours are sampled every `step_` pixels of the image and summed over square cells of kCell × kCell samples, each
  // side apart. What a pixel sees of them is summed at the nodes, the middles of cells, and linear between: over so
  // many samples the sums are smooth.
  static constexpr int kCell = 2, kReach = 3;  ///< samples along a cell's edge; cells to all sides of a node
  int step_, cell_px_, first_column_, first_row_, columns_, rows_;  ///< first: cell, from the image's corner
  float cells_per_px_;
  std::array<float, (2 * kReach + 1) * (2 * kReach + 1)> kernel_;  ///< weight by offset from a node, row-major
  enum class Cell : char { unknown, empty, front, behind, both };  ///< what its samples show
  std::vector<Cell> cells_;
  std::unique_ptr<Sides[]> sums_;  ///< by cell, unless it is unknown or empty
  std::vector<int> node_of_;       ///< index in `nodes_` by cell; -1: none
  std::vector<Sides> nodes_;
};

}  // namespace lumigraft::relight
