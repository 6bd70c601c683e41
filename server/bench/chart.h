#pragma once
// What charts are made of: an axis, a frame with a grid, labels that keep clear of each other.
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "server/bench/drawing.h"

namespace lumigraft::server::chart {

constexpr Colour kInk{0.13, 0.13, 0.13, 1}, kQuiet{0.42, 0.42, 0.42, 1}, kGrid{0.91, 0.91, 0.91, 1};

/// Colours that stay apart for the colour blind too (Okabe & Ito 2008); repeats.
Colour colour_of(std::size_t index);
Mark mark_of(std::size_t index);

struct Tick {
  double value;
  std::string label;  ///< empty: a line alone
};

/// A value's place on the paper.
class Axis {
 public:
  enum class Scale { linear, logarithmic };
  Axis(Scale scale, double low, double high, double at_low, double at_high);
  double at(double value) const;
  bool holds(double value) const { return value >= low_ && value <= high_; }
  double low() const { return low_; }
  double high() const { return high_; }

 private:
  Scale scale_;
  double low_, high_, at_low_, at_high_;
};

/// 1, 2, 5, 10, ... as milliseconds and seconds; labels at decades alone where `width` is too little for all.
std::vector<Tick> time_ticks(double low_ms, double high_ms, double width);
/// About `wanted` round steps from 0.
std::vector<Tick> round_ticks(double high, int wanted);
double round_up(double value, int wanted);  ///< to the next of those steps

/// Grid, ticks and the frame's two axes.
void draw_frame(Drawing& drawing, const Box& frame, const Axis& x, const std::vector<Tick>& x_ticks, const Axis& y,
                const std::vector<Tick>& y_ticks, double text_size);

struct Label {
  Point at;  ///< what it names
  std::string text;
  Colour colour;
};

/// Writes each label near its point, clear of `taken`, of each other and within `frame`, in their order; away from
/// `lines` where it can. Leads a line to a label that stands off. A label that finds no place is left
/// out. Returns the places.
std::vector<std::optional<Box>> place_labels(Drawing& drawing, const std::vector<Label>& labels, const Box& frame,
                                             std::vector<Box> taken, const std::vector<std::vector<Point>>& lines,
                                             double text_size);

/// SVG and PNG beside each other: STEM.svg, STEM.png. PNG has half as many pixels again along each side.
void write(const Drawing& drawing, const std::filesystem::path& stem);

}  // namespace lumigraft::server::chart
