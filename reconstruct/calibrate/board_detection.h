#pragma once
// Where a picture shows which points of the board.
#include <Eigen/Core>
#include <memory>
#include <optional>
#include <vector>

#include "capture/camera/camera_model.h"
#include "capture/image.h"
#include "reconstruct/calibrate/board.h"
#include "reconstruct/calibrate/corners.h"

namespace lumigraft::reconstruct {

/// Points whose errors belong together: the four corners of a tag, or one corner of a chessboard.
struct SeenPoints {
  int place = 0;                          ///< which tag, or corner
  std::vector<Eigen::Vector3d> points_m;  ///< on the board
  std::vector<Eigen::Vector2d> pixels;
  Eigen::MatrixXd whitening;  ///< makes the stacked errors in pixels independent and of one variance
  double paper = 0;           ///< light of the white paper, 1 is the brightest that there is; 0: not known
};

struct BoardView {
  std::vector<SeenPoints> seen;
};

class BoardFinder {
 public:
  explicit BoardFinder(const Board& board);
  ~BoardFinder();

  /// Empty where the board does not show. `grey` is what a detector likes, `light` what edges are measured in.
  BoardView find(const capture::Image<std::uint8_t>& grey, const capture::Image<std::uint16_t>& light) const;
  /// The same points, measured again now that something is known of the lens. A chessboard's stay as they are: the
  /// squares around a corner pull it in no direction.
  BoardView again(const BoardView& view, const capture::Image<std::uint16_t>& light,
                  const capture::CameraModel& camera) const;

 private:
  SeenPoints tag(int tag, const PrintCorners& corners) const;
  BoardView find_chessboard(const capture::Image<std::uint8_t>& grey) const;

  Board board_;
  std::unique_ptr<TagFinder> finder_;
};

}  // namespace lumigraft::reconstruct
