#pragma once
// The calibration board: tags in rows and columns, or a chessboard.
//
//     kind = "tags"            # or "chessboard"
//     family = "tag36h11"      # tags: tag25h9 and tag16h5 too
//     first_id = 0             # tags: number of the top left one; numbers go on along the rows
//     rows = 5                 # of tags; of a chessboard the corners inside, where four squares meet
//     columns = 7
//     size_m = 0.032           # edge of a tag's black square, or of a chessboard's square
//     spacing_m = 0.008        # tags: paper between two black squares
//
// The board's frame: origin at its centre, x to the right of the upright board, y to its top, z out of the paper.
#include <Eigen/Core>
#include <ostream>
#include <string>

#include "capture/session/config.h"
#include "reconstruct/pose/tag.h"

namespace lumigraft::reconstruct {

struct Board {
  enum class Kind { tags, chessboard };

  Kind kind = Kind::tags;
  std::string family = "tag36h11";
  int first_id = 0;
  int rows = 5;
  int columns = 7;
  double size_m = 0.032;
  double spacing_m = 0.008;

  int tags() const { return kind == Kind::tags ? rows * columns : 0; }
  /// Distance from one tag, or chessboard corner, to the next.
  double pitch_m() const { return kind == Kind::tags ? size_m + spacing_m : size_m; }
  /// Width and height of the printed pattern.
  Eigen::Vector2d extent_m() const;
  /// Centre of a tag, or a chessboard corner, in the board's frame; indexed row by row from the top left.
  Eigen::Vector3d place_m(int index) const;
  /// Corners of a tag's black square, in the order of TagCorners.
  std::array<Eigen::Vector3d, 4> corners_m(int tag) const;
  /// The tags as configuration of the detector.
  capture::Tag tag_list() const;
};

/// Throws InputError. The caller calls root.finish().
Board read_board(const capture::ConfigTable& root);

/// Writes the board for printing: an SVG drawing in millimetres.
void write_board_svg(std::ostream& out, const Board& board);

}  // namespace lumigraft::reconstruct
