#include "server/bench/chart.h"

#include <gtest/gtest.h>

#include <fstream>

#include "capture/formats/picture_file.h"

namespace lumigraft::server::chart {
namespace {

std::vector<std::string> labels_of(const std::vector<Tick>& ticks) {
  std::vector<std::string> labels;
  for (const Tick& tick : ticks) {
    labels.push_back(tick.label);
  }
  return labels;
}

TEST(Chart, AxesPutValuesInTheirPlaces) {
  const Axis linear(Axis::Scale::linear, 0, 2, 100, 50);
  EXPECT_DOUBLE_EQ(linear.at(0.5), 87.5);
  const Axis decades(Axis::Scale::logarithmic, 10, 1000, 0, 200);
  EXPECT_NEAR(decades.at(100), 100, 1e-9);
}

TEST(Chart, TicksAreRound) {
  EXPECT_EQ(labels_of(time_ticks(100, 2000, 300)),
            (std::vector<std::string>{"100 ms", "200 ms", "500 ms", "1 s", "2 s"}));
  EXPECT_EQ(labels_of(time_ticks(1, 10000, 300))[3], "10 ms");
  EXPECT_EQ(labels_of(time_ticks(1, 10000, 300))[1], "");  // crowded: labels only at decades
  EXPECT_EQ(labels_of(round_ticks(0.6, 6)), (std::vector<std::string>{"0", "0.1", "0.2", "0.3", "0.4", "0.5", "0.6"}));
  EXPECT_NEAR(round_up(0.51, 6), 0.6, 1e-12);
  EXPECT_NEAR(round_up(0.6, 6), 0.6, 1e-12);
}

// Many points: placed labels overlap no point and no other label, and stay inside.
TEST(Chart, LabelsDoNotCollide) {
  Drawing drawing(300, 200);
  const Box frame{0, 0, 300, 200};
  std::vector<Label> labels;
  std::vector<Box> points;
  for (int i = 0; i < 16; ++i) {
    const Point p{120 + 9.0 * (i % 4), 80 + 7.0 * static_cast<double>(i / 4)};
    points.push_back({p.x - 5, p.y - 5, p.x + 5, p.y + 5});
    labels.push_back({p, "setting-" + std::to_string(i), kInk});
  }
  const std::vector<std::optional<Box>> places = place_labels(drawing, labels, frame, points, {}, 10);
  ASSERT_EQ(places.size(), labels.size());
  int placed = 0;
  for (std::size_t i = 0; i < places.size(); ++i) {
    if (!places[i]) {
      continue;
    }
    ++placed;
    EXPECT_GE(places[i]->left, frame.left);
    EXPECT_LE(places[i]->right, frame.right);
    for (const Box& point : points) {
      EXPECT_FALSE(places[i]->overlaps(point));
    }
    for (std::size_t j = 0; j < i; ++j) {
      EXPECT_FALSE(places[j] && places[i]->overlaps(*places[j])) << i << " and " << j;
    }
  }
  EXPECT_GT(placed, 8);
}

TEST(Chart, OneDrawingInTwoFiles) {
  Drawing drawing(40, 20);
  drawing.fill({10, 0, 20, 20}, {1, 0, 0, 1});
  drawing.line({{30, 0}, {30, 20}}, {kInk, 2});
  const std::filesystem::path stem = std::filesystem::path(testing::TempDir()) / "lumigraft-chart";
  write(drawing, stem);
  const capture::Image<std::uint8_t> png = capture::read_encoded(stem.string() + ".png");
  EXPECT_EQ(png.width, 60);
  EXPECT_EQ(png.height, 30);
  EXPECT_EQ(png.at(22, 15, 0), 255);
  EXPECT_EQ(png.at(22, 15, 1), 0);
  EXPECT_EQ(png.at(5, 15, 1), 255);
  std::ifstream svg(stem.string() + ".svg");
  EXPECT_NE(std::string(std::istreambuf_iterator<char>(svg), {}).find("<svg"), std::string::npos);
  std::filesystem::remove(stem.string() + ".png");
  std::filesystem::remove(stem.string() + ".svg");
  EXPECT_THROW(drawing.write_png("/nowhere/a.png", 1), std::runtime_error);
}

}  // namespace
}  // namespace lumigraft::server::chart
