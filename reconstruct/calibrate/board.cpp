#include "reconstruct/calibrate/board.h"

#include <algorithm>

#include "capture/message_text.h"
#include "reconstruct/calibrate/parameters.h"
#include "reconstruct/math/planar_pose.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Vector2d;
using Eigen::Vector3d;

int tags_in(const std::string& family) { return family == "tag36h11" ? 587 : family == "tag25h9" ? 35 : 30; }

std::string millimetres(double m) { return capture::formatted("%.4f", 1e3 * m); }

/// Writes the black runs of every row as one path: printers draw hairlines between separate paths.
void write_cells(std::ostream& out, const TagPattern& pattern, const Vector2d& top_left_m, double cell_m) {
  const int border = (pattern.cells - pattern.square_cells) / 2;
  out << "<path d=\"";
  for (int row = border; row < border + pattern.square_cells; ++row)
    for (int column = border; column < border + pattern.square_cells;) {
      int end = column;
      while (end < border + pattern.square_cells && !pattern.white_at(end, row)) ++end;
      if (end > column)
        out << 'M' << millimetres(top_left_m.x() + (column - border) * cell_m) << ' '
            << millimetres(top_left_m.y() + (row - border) * cell_m) << 'h' << millimetres((end - column) * cell_m)
            << 'v' << millimetres(cell_m) << "h-" << millimetres((end - column) * cell_m) << 'z';
      column = end + 1;
    }
  out << "\"/>\n";
}

}  // namespace

Vector2d Board::extent_m() const {
  if (kind == Kind::chessboard) return size_m * Vector2d(columns + 1, rows + 1);
  return Vector2d(columns * pitch_m() - spacing_m, rows * pitch_m() - spacing_m);
}

Vector3d Board::place_m(int index) const {
  const int at_row = index / columns, at_column = index % columns;
  const double column = at_column - 0.5 * (columns - 1), row = 0.5 * (rows - 1) - at_row;
  return {column * pitch_m(), row * pitch_m(), 0.0};
}

std::array<Vector3d, 4> Board::corners_m(int tag) const {
  std::array<Vector3d, 4> corners = tag_corners(size_m);
  for (Vector3d& corner : corners) corner += place_m(tag);
  return corners;
}

capture::Tag Board::tag_list() const {
  capture::Tag list{.family = family, .id = first_id, .size_m = size_m};
  for (int tag = 1; tag < tags(); ++tag)
    list.extra.push_back({.id = first_id + tag, .size_m = size_m, .T_tag_extra = {}});
  return list;
}

Board read_board(const capture::ConfigTable& root) {
  Board board;
  const bool tags = root.choice("kind", {"tags", "chessboard"}, "tags") == "tags";
  board.kind = tags ? Board::Kind::tags : Board::Kind::chessboard;
  board.rows = root.integer("rows", tags ? 1 : 3, kCalibration.max_rows);
  board.columns = root.integer("columns", tags ? 1 : 3, kCalibration.max_rows);
  board.size_m = root.number("size_m", kCalibration.min_size_m, kCalibration.max_size_m);
  if (!tags) return board;
  board.family = root.choice("family", {"tag36h11", "tag25h9", "tag16h5"}, board.family);
  board.spacing_m = root.number("spacing_m", kCalibration.min_spacing * board.size_m, kCalibration.max_size_m);
  board.first_id = root.integer("first_id", 0, tags_in(board.family) - 1, 0);
  if (board.first_id + board.tags() > tags_in(board.family)) {
    root.fail("rows", "found " + std::to_string(board.tags()) + " tags from number " + std::to_string(board.first_id) +
                          ", allowed: numbers below " + std::to_string(tags_in(board.family)) + " in " + board.family);
  }
  return board;
}

void write_board_svg(std::ostream& out, const Board& board) {
  const double margin_m =
      board.kind == Board::Kind::tags ? std::max(board.spacing_m, 0.25 * board.size_m) : board.size_m;
  const Vector2d size = board.extent_m() + Vector2d::Constant(2 * margin_m);
  out << "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"" << millimetres(size.x()) << "mm\" height=\""
      << millimetres(size.y()) << "mm\" viewBox=\"0 0 " << millimetres(size.x()) << ' ' << millimetres(size.y())
      << "\">\n<rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n";
  // From the board's frame to the drawing: origin at the top left, y down.
  const auto drawn = [&](const Vector3d& p) { return Vector2d(0.5 * size.x() + p.x(), 0.5 * size.y() - p.y()); };
  if (board.kind == Board::Kind::tags) {
    const TagFinder finder(board.tag_list());
    for (int tag = 0; tag < board.tags(); ++tag) {
      const TagPattern& pattern = finder.pattern(static_cast<std::size_t>(tag));
      write_cells(out, pattern, drawn(board.corners_m(tag)[3]), board.size_m / pattern.square_cells);
    }
  } else {
    const Vector2d first = drawn(board.place_m(0)) - Vector2d::Constant(board.size_m);
    for (int row = 0; row <= board.rows; ++row)
      for (int column = row % 2; column <= board.columns; column += 2)
        out << "<rect x=\"" << millimetres(first.x() + column * board.size_m) << "\" y=\""
            << millimetres(first.y() + row * board.size_m) << "\" width=\"" << millimetres(board.size_m)
            << "\" height=\"" << millimetres(board.size_m) << "\"/>\n";
  }
  out << "</svg>\n";
}

}  // namespace lumigraft::reconstruct
