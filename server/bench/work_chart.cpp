#include <algorithm>
#include <cmath>

#include "capture/message_text.h"
#include "server/bench/chart.h"
#include "server/bench/work.h"

namespace lumigraft::server {
namespace {

using namespace chart;

/// Such as "12.3 k" or "4 M".
std::string short_number(double value) {
  if (value >= 1e6) return capture::formatted("%.3g M", value / 1e6);
  return value >= 1e4 ? capture::formatted("%.3g k", value / 1e3) : capture::formatted("%.0f", value);
}

double powers_of_two(double value, double (*round)(double)) { return std::exp2(round(std::log2(value))); }

void draw_kind(Drawing& drawing, const Box& frame, const std::string& kind, const std::vector<WorkRow>& rows,
               double base_ms, const Axis& y, const std::vector<Tick>& y_ticks) {
  const auto [least, most] = std::ranges::minmax_element(rows, {}, &WorkRow::amount);
  const double low = least->amount, high = most->amount;
  const double margin = std::pow(high / low, 0.08);
  const Axis x{Axis::Scale::logarithmic, low / margin, high * margin, frame.left, frame.right};
  std::vector<Tick> ticks;
  for (const WorkRow& row : rows) ticks.push_back({row.amount, short_number(row.amount)});
  draw_frame(drawing, frame, x, ticks, y, y_ticks, kSmall);
  drawing.text({frame.left, frame.top - 8}, kind, {.size = kText, .bold = true});

  // The line of proportional cost, through the session's own amount or the smallest.
  const auto base = std::ranges::find(rows, true, &WorkRow::base);
  const WorkRow& through = base != rows.end() ? *base : rows.front();
  const double slope = through.cost.host.cpu_ms / base_ms / through.amount;
  const double from = std::max(x.low, y.low / slope), to = std::min(x.high, y.high / slope);
  if (from < to) {
    drawing.line({{x.at(from), y.at(from * slope)}, {x.at(to), y.at(to * slope)}}, {kQuiet.faded(0.6), 1.2, 4});
  }
  std::vector<Point> line;
  for (const WorkRow& row : rows) line.push_back({x.at(row.amount), y.at(row.cost.host.cpu_ms / base_ms)});
  drawing.line(line, {colour_of(0), 2});
  for (std::size_t i = 0; i < rows.size(); ++i) {
    drawing.mark(Mark::disk, line[i], 4.5, colour_of(0), rows[i].base);
    drawing.text({line[i].x, line[i].y - 9}, capture::formatted("%.2f", rows[i].cost.host.cpu_ms / base_ms),
                 {.size = kSmall, .across = 0.5});
  }
}

}  // namespace

void draw_cost_work(const BenchResults& results, const std::filesystem::path& stem) {
  const std::vector<std::string> kinds = distinct(results.work, &WorkRow::work);
  double base_ms = 0, low = 1, high = 1;
  for (const WorkRow& row : results.work) base_ms = row.base && base_ms == 0 ? row.cost.host.cpu_ms : base_ms;
  if (base_ms == 0) return;
  for (const WorkRow& row : results.work) {
    low = std::min(low, row.cost.host.cpu_ms / base_ms), high = std::max(high, row.cost.host.cpu_ms / base_ms);
  }
  low = powers_of_two(0.85 * low, std::floor), high = powers_of_two(1.3 * high, std::ceil);
  std::vector<Tick> y_ticks;
  for (double value = low; value <= high * 1.01; value *= 2) {
    y_ticks.push_back({value, capture::formatted("%g", value)});
  }
  constexpr double kWidth = 960, kHeight = 600;
  Drawing drawing(kWidth, kHeight);
  drawing.text({20, 30}, "Cost against work", {.size = 18, .bold = true});
  drawing.text({20, 50},
               capture::formatted("CPU time of a frame over that of %s with %s, %.0f ms, the object turning by 1°",
                                  results.work_session.c_str(), results.work_setting.c_str(), base_ms),
               {.size = kText, .colour = kQuiet});
  drawing.mark(Mark::disk, {26, 70}, 4.5, colour_of(0), true);
  drawing.text({36, 74}, "as in the session", {.size = kText});
  const double after = 36 + drawing.text_width("as in the session", {.size = kText}) + 20;
  drawing.line({{after, 70}, {after + 24, 70}}, {kQuiet.faded(0.6), 1.2, 4});
  drawing.text({after + 30, 74}, "in proportion to the work", {.size = kText});
  for (std::size_t i = 0; i < kinds.size(); ++i) {
    const double left = 50 + 308 * static_cast<double>(i % 3), top = 120 + 236 * static_cast<double>(i / 3);
    const Box frame{left, top, left + 262, top + 180};
    std::vector<WorkRow> rows;
    std::copy_if(results.work.begin(), results.work.end(), std::back_inserter(rows),
                 [&](const WorkRow& row) { return row.work == kinds[i]; });
    const Axis y{Axis::Scale::logarithmic, low, high, frame.bottom, frame.top};
    draw_kind(drawing, frame, kinds[i], rows, base_ms, y, y_ticks);
  }
  drawing.text({20, kHeight - 12}, line_of(results.machine), {.size = kSmall, .colour = kQuiet});
  write(drawing, stem);
}

}  // namespace lumigraft::server
