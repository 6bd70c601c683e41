#include "server/bench/chart.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "capture/message_text.h"

namespace lumigraft::server::chart {
namespace {

constexpr double kPngScale = 1.5;

std::string time_label(double ms) {
  return ms < 1000 ? capture::formatted("%g ms", ms) : capture::formatted("%g s", ms / 1000);
}

double round_step(double high, int wanted) {
  const double raw = high / wanted, ten = std::pow(10.0, std::floor(std::log10(raw)));
  for (const double factor : {1.0, 2.0, 5.0}) {
    if (raw <= factor * ten * (1 + 1e-9)) return factor * ten;
  }
  return 10 * ten;
}

/// Whether the segment from a to b intersects the box.
bool crosses(const Point& a, const Point& b, const Box& box) {
  double from = 0, to = 1;  // Liang & Barsky 1984
  const double dx = b.x - a.x, dy = b.y - a.y;
  const std::array<std::array<double, 2>, 4> sides{
      {{-dx, a.x - box.left}, {dx, box.right - a.x}, {-dy, a.y - box.top}, {dy, box.bottom - a.y}}};
  for (const auto& [p, q] : sides) {
    if (p == 0) {
      if (q < 0) return false;
    } else if (p < 0) {
      from = std::max(from, q / p);
    } else {
      to = std::min(to, q / p);
    }
  }
  return from <= to;
}

int crossings(const std::vector<std::vector<Point>>& lines, const Box& box) {
  int count = 0;
  for (const std::vector<Point>& line : lines) {
    for (std::size_t i = 1; i < line.size(); ++i) count += crosses(line[i - 1], line[i], box) ? 1 : 0;
  }
  return count;
}

}  // namespace

Colour colour_of(std::size_t index) {
  static const std::array<Colour, 6> colours{{{0.00, 0.45, 0.70, 1},
                                              {0.84, 0.37, 0.00, 1},
                                              {0.00, 0.62, 0.45, 1},
                                              {0.80, 0.47, 0.65, 1},
                                              {0.90, 0.62, 0.00, 1},
                                              {0.34, 0.71, 0.91, 1}}};
  return colours[index % colours.size()];
}

Mark mark_of(std::size_t index) {
  static const std::array<Mark, 4> marks{Mark::disk, Mark::square, Mark::diamond, Mark::triangle};
  return marks[index % marks.size()];
}

double Axis::at(double value) const {
  const double fraction =
      scale == Scale::linear ? (value - low) / (high - low) : std::log(value / low) / std::log(high / low);
  return at_low + fraction * (at_high - at_low);
}

std::vector<Tick> time_ticks(double low_ms, double high_ms, double width) {
  constexpr double kLabel = 52;  // width of a label with its margin
  std::vector<Tick> ticks;
  for (int power = -4; power < 9; ++power) {
    for (const double factor : {1.0, 2.0, 5.0}) {
      const double value = factor * std::pow(10.0, power);
      if (value >= low_ms * (1 - 1e-9) && value <= high_ms * (1 + 1e-9)) ticks.push_back({value, time_label(value)});
    }
  }
  if (kLabel * static_cast<double>(ticks.size()) > width) {
    for (Tick& tick : ticks) {
      const double power = std::log10(tick.value);
      if (std::abs(power - std::round(power)) > 1e-6) tick.label.clear();
    }
  }
  return ticks;
}

std::vector<Tick> round_ticks(double high, int wanted) {
  const double step = round_step(high, wanted);
  std::vector<Tick> ticks;
  for (int i = 0; i * step <= high * (1 + 1e-9); ++i) {
    ticks.push_back({i * step, capture::formatted("%g", std::round(i * step * 1e6) / 1e6)});
  }
  return ticks;
}

double round_up(double value, int wanted) {
  const double step = round_step(value, wanted);
  return step * std::ceil(value / step * (1 - 1e-9));
}

void draw_frame(Drawing& drawing, const Box& frame, const Axis& x, const std::vector<Tick>& x_ticks, const Axis& y,
                const std::vector<Tick>& y_ticks, double text_size) {
  for (const Tick& tick : x_ticks) {
    const double at = x.at(tick.value);
    drawing.line({{at, frame.top}, {at, frame.bottom}}, {kGrid, 1});
    drawing.text({at, frame.bottom + 1.5 * text_size}, tick.label,
                 {.size = text_size, .colour = kQuiet, .across = 0.5});
  }
  for (const Tick& tick : y_ticks) {
    const double at = y.at(tick.value);
    drawing.line({{frame.left, at}, {frame.right, at}}, {kGrid, 1});
    drawing.text({frame.left - 6, at + 0.36 * text_size}, tick.label,
                 {.size = text_size, .colour = kQuiet, .across = 1});
  }
  drawing.line({{frame.left, frame.top}, {frame.left, frame.bottom}, {frame.right, frame.bottom}}, {kQuiet, 1});
}

std::vector<std::optional<Box>> place_labels(Drawing& drawing, const std::vector<Label>& labels, const Box& frame,
                                             std::vector<Box> taken, const std::vector<std::vector<Point>>& lines,
                                             double text_size) {
  constexpr int kDirections = 16;
  constexpr double kLead = 22;  // a label farther away gets a leader line
  std::vector<std::optional<Box>> places;
  for (const Label& label : labels) {
    const TextStyle style{.size = text_size, .colour = label.colour};
    const double width = drawing.text_width(label.text, style), height = text_size;
    std::optional<Box> best;
    double best_cost = std::numeric_limits<double>::max(), best_reach = 0;
    for (const double reach : {9.0, 14.0, 20.0, 30.0, 42.0, 56.0, 72.0}) {
      for (int i = 0; i < kDirections; ++i) {
        const double angle = 2 * std::numbers::pi * i / kDirections;
        // The side or corner of the box nearest to the point touches the circle of radius `reach`.
        const double cx = label.at.x + reach * std::cos(angle) + 0.5 * width * std::cos(angle);
        const double cy = label.at.y + reach * std::sin(angle) + 0.5 * height * std::sin(angle);
        const Box box{cx - 0.5 * width - 2, cy - 0.5 * height - 1, cx + 0.5 * width + 2, cy + 0.5 * height + 1};
        if (box.left < frame.left || box.right > frame.right || box.top < frame.top || box.bottom > frame.bottom ||
            std::any_of(taken.begin(), taken.end(), [&](const Box& other) { return box.overlaps(other); })) {
          continue;
        }
        const double cost = reach + 8.0 * crossings(lines, box) + (std::sin(angle) > 0.01 ? 2 : 0) +
                            (std::abs(std::cos(angle)) < 0.95 ? 1 : 0);
        if (cost < best_cost) {
          best_cost = cost;
          best_reach = reach;
          best = box;
        }
      }
    }
    places.push_back(best);
    if (!best) continue;
    taken.push_back(*best);
    if (best_reach >= kLead) {
      const Point near{std::clamp(label.at.x, best->left + 2, best->right - 2),
                       std::clamp(label.at.y, best->top + 1, best->bottom - 1)};
      drawing.line({label.at, near}, {label.colour.faded(0.6), 0.8});
    }
    drawing.text({best->left + 2, best->bottom - 0.22 * height - 1}, label.text, style);
  }
  return places;
}

void write(const Drawing& drawing, const std::filesystem::path& stem) {
  drawing.write_svg(stem.string() + ".svg");
  drawing.write_png(stem.string() + ".png", kPngScale);
}

}  // namespace lumigraft::server::chart
