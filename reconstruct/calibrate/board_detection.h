#pragma once
// Detection of the board's points in a picture.
#include <Eigen/Core>
#include <memory>
#include <vector>

#include "capture/camera/camera_model.h"
#include "capture/image.h"
#include "reconstruct/calibrate/board.h"
#include "reconstruct/calibrate/corners.h"

namespace lumigraft::reconstruct {

/// Points with correlated errors: the four corners of a tag, or one chessboard corner.
struct SeenPoints {
  int place = 0;                          ///< index of the tag or corner
  std::vector<Eigen::Vector3d> points_m;  ///< in the board's frame
  std::vector<Eigen::Vector2d> pixels;
  Eigen::MatrixXd whitening;  ///< makes the stacked pixel errors independent with equal variance
  double paper = 0;           ///< linear light of the white paper, 1 is the picture's maximum; 0: unknown
};

struct BoardView {
  std::vector<SeenPoints> seen;

  std::size_t points() const {
    std::size_t points = 0;
    for (const SeenPoints& one : seen) points += one.pixels.size();
    return points;
  }
};

class BoardFinder {
 public:
  explicit BoardFinder(const Board& board);

  /// Empty where the board is not detected. `grey` is used for detection, `light` (linear) for edge positions.
  BoardView find(const capture::Image<std::uint8_t>& grey, const capture::Image<std::uint16_t>& light) const;
  /// Refines the points with a known lens model. Chessboard corners stay unchanged: their symmetric surroundings cause
  /// no bias.
  BoardView again(const BoardView& view, const capture::Image<std::uint16_t>& light,
                  const capture::CameraModel& camera) const;

 private:
  SeenPoints tag(int tag, const PrintCorners& corners) const;
  BoardView find_chessboard(const capture::Image<std::uint8_t>& grey) const;

  Board board_;
  std::unique_ptr<TagFinder> finder_;
};

}  // namespace lumigraft::reconstruct
