#pragma once
// Elements of charts: axes, ticks, a frame with a grid, labels that do not overlap.
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "server/bench/drawing.h"

namespace lumigraft::server::chart {

constexpr Colour kInk{0.13, 0.13, 0.13, 1}, kQuiet{0.42, 0.42, 0.42, 1}, kGrid{0.91, 0.91, 0.91, 1};
constexpr double kText = 12, kSmall = 10.5;  ///< sizes of text

/// Colours that colour-blind readers can distinguish (Okabe & Ito 2008); repeats.
Colour colour_of(std::size_t index);
Mark mark_of(std::size_t index);

struct Tick {
  double value;
  std::string label;  ///< empty: a grid line only
};

/// Maps values to coordinates of the drawing.
struct Axis {
  enum class Scale { linear, logarithmic };
  Scale scale;
  double low, high, at_low, at_high;
  double at(double value) const;
};

/// Ticks at 1, 2, 5, 10, ... in milliseconds and seconds; labels only at decades where `width` is too small for all.
std::vector<Tick> time_ticks(double low_ms, double high_ms, double width);
/// Ticks in about `wanted` round steps from 0.
std::vector<Tick> round_ticks(double high, int wanted);
double round_up(double value, int wanted);  ///< to the next of those steps

/// Draws the grid, the ticks and the two axes.
void draw_frame(Drawing& drawing, const Box& frame, const Axis& x, const std::vector<Tick>& x_ticks, const Axis& y,
                const std::vector<Tick>& y_ticks, double text_size);

struct Label {
  Point at;  ///< the labelled point
  std::string text;
  Colour colour;
};

/// Places the labels in their order, each near its point and within `frame`, without overlap with `taken` or other
/// labels, and away from `lines` where possible. Draws a leader line to a label that is not adjacent to its point. A
/// label that does not fit is left out. Returns the boxes.
std::vector<std::optional<Box>> place_labels(Drawing& drawing, const std::vector<Label>& labels, const Box& frame,
                                             std::vector<Box> taken, const std::vector<std::vector<Point>>& lines,
                                             double text_size);

/// Writes STEM.svg and STEM.png. The PNG has 1.5 pixels per unit.
void write(const Drawing& drawing, const std::filesystem::path& stem);

}  // namespace lumigraft::server::chart
