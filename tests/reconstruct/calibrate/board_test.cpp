#include "reconstruct/calibrate/board.h"

#include <gtest/gtest.h>

#include <regex>
#include <sstream>

#include "capture/error.h"

namespace lumigraft::reconstruct {
namespace {

Board board_of(const std::string& text) {
  const capture::ConfigTable root = capture::ConfigTable::parse(text, "board.toml");
  Board board = read_board(root);
  root.finish();
  return board;
}

std::string error_of(const std::string& text) {
  try {
    board_of(text);
  } catch (const capture::InputError& e) {
    return e.what();
  }
  return "no error";
}

TEST(CalibrateBoard, SaysWhereItsPointsAre) {
  const Board tags = board_of("rows = 2\ncolumns = 3\nsize_m = 0.04\nspacing_m = 0.01\nfirst_id = 7");
  EXPECT_EQ(tags.tags(), 6);
  EXPECT_TRUE(tags.place_m(0).isApprox(Eigen::Vector3d(-0.05, 0.025, 0)));
  EXPECT_TRUE(tags.place_m(5).isApprox(Eigen::Vector3d(0.05, -0.025, 0)));
  const auto corners = tags.corners_m(0);  // bottom left, bottom right, top right, top left
  EXPECT_TRUE(corners[0].isApprox(Eigen::Vector3d(-0.07, 0.005, 0)));
  EXPECT_TRUE(corners[2].isApprox(Eigen::Vector3d(-0.03, 0.045, 0)));
  EXPECT_TRUE(tags.extent_m().isApprox(Eigen::Vector2d(0.14, 0.09)));
  const capture::Tag list = tags.tag_list();
  EXPECT_EQ(list.id, 7);
  ASSERT_EQ(list.extra.size(), 5u);
  EXPECT_EQ(list.extra.back().id, 12);

  const Board chess = board_of("kind = \"chessboard\"\nrows = 4\ncolumns = 5\nsize_m = 0.03");
  EXPECT_TRUE(chess.place_m(0).isApprox(Eigen::Vector3d(-0.06, 0.045, 0)));
  EXPECT_TRUE(chess.extent_m().isApprox(Eigen::Vector2d(0.18, 0.15)));
}

TEST(CalibrateBoard, RefusesWhatCannotBePrinted) {
  const std::string good = "rows = 2\ncolumns = 3\nsize_m = 0.04\n";
  EXPECT_NE(error_of(good).find("spacing_m"), std::string::npos);
  EXPECT_NE(error_of(good + "spacing_m = 0.004").find("spacing_m"), std::string::npos) << "no quiet border";
  EXPECT_NE(error_of(good + "spacing_m = 0.01\nfirst_id = 582").find("582"), std::string::npos);
  EXPECT_NE(error_of(good + "spacing_m = 0.01\ncolour = 1").find("colour"), std::string::npos);
  EXPECT_NE(error_of("kind = \"circles\"\n" + good).find("chessboard"), std::string::npos);
}

/// Black area in mm² of a drawing of M x y h w v h h -w z paths and rectangles.
double black_mm2(const std::string& svg) {
  double area = 0;
  const std::regex piece("M([\\d.]+) ([\\d.]+)h([\\d.]+)v([\\d.]+)h-"),
      square("<rect x=\"[\\d.]+\" y=\"[\\d.]+\" width=\"([\\d.]+)\" height=\"([\\d.]+)\"");
  for (std::sregex_iterator i(svg.begin(), svg.end(), piece), end; i != end; ++i)
    area += std::stod((*i)[3]) * std::stod((*i)[4]);
  for (std::sregex_iterator i(svg.begin(), svg.end(), square), end; i != end; ++i)
    area += std::stod((*i)[1]) * std::stod((*i)[2]);
  return area;
}

TEST(CalibrateBoard, IsDrawnInMillimetres) {
  const Board board = board_of("rows = 1\ncolumns = 2\nsize_m = 0.04\nspacing_m = 0.01");
  std::ostringstream svg;
  write_board_svg(svg, board);
  EXPECT_NE(svg.str().find("width=\"110.0000mm\" height=\"60.0000mm\" viewBox=\"0 0 110.0000 60.0000\""),
            std::string::npos)
      << svg.str().substr(0, 200);
  const TagFinder finder(board.tag_list());
  double black = 0;
  for (std::size_t tag = 0; tag < 2; ++tag)
    for (const auto white : finder.pattern(tag).white) black += white == 0 ? 5.0 * 5.0 : 0;
  EXPECT_NEAR(black_mm2(svg.str()), black, 1e-6);

  std::ostringstream chess;
  write_board_svg(chess, board_of("kind = \"chessboard\"\nrows = 4\ncolumns = 5\nsize_m = 0.03"));
  EXPECT_NEAR(black_mm2(chess.str()), 15 * 900, 1e-6) << "half of 5 × 6 squares";
}

}  // namespace
}  // namespace lumigraft::reconstruct
