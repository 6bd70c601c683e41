#include "server/bench/error_time_chart.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <optional>
#include <utility>

#include "capture/message_text.h"
#include "server/bench/chart.h"

namespace lumigraft::server {
namespace {

using namespace chart;

/// A virtual Cornell box with a bunny inside on a real plane: Franke 2015, fig. 5.19 (time of a frame, PSNR).
struct Published {
  const char* name;
  double time_ms, psnr_db;
};
constexpr Published kPublished[] = {{"DIR", 36, 27.8689},
                                    {"DIC", 100, 35.4106},
                                    {"path tracing", 100, 31.1039},
                                    {"DLPV", 22, 26.5559},
                                    {"DVCT", 28, 30.2468}};
constexpr const char* kPublishedScene = "box-with-inside";  // prefix of the names of sessions with such a scene

std::optional<double> cost_of(const FrameCost& cost, CostKind kind) {
  return kind == CostKind::cpu ? std::optional(cost.host.cpu_ms) : cost.gpu_ms;
}

/// The plan's methods in a fixed order, then other methods named by the rows: external programs.
std::vector<std::string> all_methods(const std::vector<BenchRow>& rows) {
  std::vector<std::string> methods = relight::plan_methods();
  for (const std::string& method : distinct(rows, &BenchRow::method)) {
    if (std::find(methods.begin(), methods.end(), method) == methods.end()) methods.push_back(method);
  }
  return methods;
}

/// A decade's 1, 2 or 5 at or below (above) a value.
double round_down_125(double value) {
  const double ten = std::pow(10.0, std::floor(std::log10(value)));
  return value >= 5 * ten ? 5 * ten : value >= 2 * ten ? 2 * ten : ten;
}
double round_up_125(double value) {
  const double ten = std::pow(10.0, std::floor(std::log10(value)));
  return value <= 2 * ten ? 2 * ten : value <= 5 * ten ? 5 * ten : 10 * ten;
}

Box around(const Point& p, double reach) { return {p.x - reach, p.y - reach, p.x + reach, p.y + reach}; }

struct MethodStyles {
  std::vector<std::string> methods;

  std::size_t index_of(const std::string& method) const {
    return static_cast<std::size_t>(std::find(methods.begin(), methods.end(), method) - methods.begin());
  }
  Colour colour(const std::string& method) const { return colour_of(index_of(method)); }
  Mark mark(const std::string& method) const { return mark_of(index_of(method)); }
};

void draw_legend(Drawing& drawing, Point at, const std::vector<std::string>& methods, const MethodStyles& styles) {
  for (const std::string& method : methods) {
    drawing.mark(styles.mark(method), {at.x + 5, at.y - 4}, 5, styles.colour(method));
    drawing.text({at.x + 16, at.y}, method, {.size = kText});
    at.x += 34 + drawing.text_width(method, {.size = kText});
  }
  drawing.line({{at.x, at.y - 4}, {at.x + 22, at.y - 4}}, {kInk.faded(0.5), 2});
  drawing.text({at.x + 28, at.y}, "Pareto front", {.size = kText});
  at.x += 46 + drawing.text_width("Pareto front", {.size = kText});
  drawing.line({{at.x, at.y - 4}, {at.x + 22, at.y - 4}}, {kQuiet.faded(0.5), 1.2});
  drawing.line({{at.x, at.y - 8}, {at.x, at.y}}, {kQuiet.faded(0.5), 1.2});
  drawing.text({at.x + 28, at.y}, "the same with nothing moving", {.size = kText});
}

/// A step line: the best error holds until the next point.
std::vector<Point> front_line(const std::vector<SettingMean>& means, const Axis& x, const Axis& y, const Box& frame) {
  std::vector<Point> line;
  for (const std::size_t i : pareto_front(means)) {
    const Point p{x.at(means[i].cost_ms), y.at(means[i].relight_error)};
    line.push_back({p.x, line.empty() ? frame.top : line.back().y});
    line.push_back(p);
  }
  if (!line.empty()) line.push_back({frame.right, line.back().y});
  return line;
}

void draw_errors(Drawing& drawing, const Box& frame, const std::vector<SettingMean>& means, CostKind kind,
                 const MethodStyles& styles) {
  double low = 1e30, lowest = 1e30, high = 0, worst = 0;
  for (const SettingMean& mean : means) {
    low = std::min(low, mean.cost_ms);
    lowest = std::min(lowest, mean.still_cost_ms);
    high = std::max(high, mean.cost_ms);
    worst = std::max(worst, mean.relight_error);
  }
  low = round_down_125(0.9 * std::clamp(lowest, low / 20, low)), high = round_up_125(1.1 * high),
  worst = round_up(1.05 * worst, 6);
  const Axis x{Axis::Scale::logarithmic, low, high, frame.left, frame.right};
  const Axis y{Axis::Scale::linear, 0, worst, frame.bottom, frame.top};
  draw_frame(drawing, frame, x, time_ticks(low, high, frame.right - frame.left), y, round_ticks(worst, 6), kText);
  drawing.text({0.5 * (frame.left + frame.right), frame.bottom + 38},
               kind == CostKind::cpu ? "CPU time of a frame, the object turning by 1° (all cores together)"
                                     : "GPU time of a frame, the object turning by 1°",
               {.size = kText, .across = 0.5});
  drawing.text({frame.left - 44, 0.5 * (frame.top + frame.bottom)}, "relight_error   (0: exact, 1: no change at all)",
               {.size = kText, .across = 0.5, .turn_degrees = -90});

  std::vector<std::vector<Point>> lines{front_line(means, x, y, frame)};
  drawing.line(lines.front(), {kInk.faded(0.5), 2});
  for (const SettingMean& mean : means) {
    const Colour colour = styles.colour(mean.method).faded(0.35);
    const double at = y.at(mean.relight_error), still = x.at(std::max(low, mean.still_cost_ms));
    lines.push_back({{still, at}, {x.at(mean.cost_ms), at}});
    drawing.line(lines.back(), {colour, 1.2});
    if (mean.still_cost_ms > low) drawing.line({{still, at - 4}, {still, at + 4}}, {colour, 1.2});
  }
  std::vector<Box> taken;
  std::vector<Label> labels;
  std::vector<std::size_t> order = pareto_front(means);  // first, so that their labels find room
  for (std::size_t i = 0; i < means.size(); ++i) {
    const Point p{x.at(means[i].cost_ms), y.at(means[i].relight_error)};
    drawing.mark(styles.mark(means[i].method), p, 5.5, styles.colour(means[i].method));
    taken.push_back(around(p, 6.5));
    if (std::find(order.begin(), order.end(), i) == order.end()) order.push_back(i);
  }
  for (const std::size_t i : order) {
    labels.push_back(
        {{x.at(means[i].cost_ms), y.at(means[i].relight_error)}, means[i].setting, styles.colour(means[i].method)});
  }
  place_labels(drawing, labels, {frame.left + 2, frame.top, frame.right + 8, frame.bottom - 2}, taken, lines, kSmall);
}

void draw_published(Drawing& drawing, const Box& frame, const std::vector<BenchRow>& rows, CostKind kind,
                    const MethodStyles& styles) {
  double low = 10, high = 200, worst = 24, best = 38;
  for (const BenchRow& row : rows) {
    const double cost_ms = *cost_of(row.run.moving, kind);
    low = std::min(low, cost_ms), high = std::max(high, cost_ms);
    worst = std::min(worst, row.run.measures.psnr_db), best = std::max(best, row.run.measures.psnr_db);
  }
  low = std::pow(10.0, std::floor(std::log10(low))), high = round_up_125(1.1 * high);
  worst = 2 * std::floor(worst / 2), best = 2 * std::ceil((best + 0.5) / 2);
  const Axis x{Axis::Scale::logarithmic, low, high, frame.left, frame.right};
  const Axis y{Axis::Scale::linear, worst, best, frame.bottom, frame.top};
  std::vector<Tick> ticks;
  for (double value = worst; value <= best + 1e-9; value += best - worst > 16 ? 4 : 2) {
    ticks.push_back({value, std::to_string(static_cast<int>(value))});
  }
  draw_frame(drawing, frame, x, time_ticks(low, high, frame.right - frame.left), y, ticks, kText);
  drawing.text({0.5 * (frame.left + frame.right), frame.bottom + 38}, "time of a frame",
               {.size = kText, .across = 0.5});
  drawing.text({frame.left - 34, 0.5 * (frame.top + frame.bottom)}, "PSNR, dB",
               {.size = kText, .across = 0.5, .turn_degrees = -90});
  std::vector<Box> taken;
  std::vector<Label> labels;
  std::map<std::size_t, const BenchRow*> highest;  // by method
  for (const BenchRow& row : rows) {
    const std::size_t method = styles.index_of(row.method);
    const Point p{x.at(*cost_of(row.run.moving, kind)), y.at(row.run.measures.psnr_db)};
    drawing.mark(mark_of(method), p, 4.5, colour_of(method));
    taken.push_back(around(p, 5.5));
    const BenchRow*& best_row = highest[method];
    if (best_row == nullptr || row.run.measures.psnr_db > best_row->run.measures.psnr_db) best_row = &row;
  }
  for (const Published& method : kPublished) {
    const Point p{x.at(method.time_ms), y.at(method.psnr_db)};
    drawing.mark(Mark::disk, p, 4.5, kInk, true);
    taken.push_back(around(p, 5.5));
    labels.push_back({p, method.name, kInk});
  }
  for (const auto& [method, row] : highest) {
    labels.push_back(
        {{x.at(*cost_of(row->run.moving, kind)), y.at(row->run.measures.psnr_db)}, row->setting, colour_of(method)});
  }
  place_labels(drawing, labels, {frame.left + 2, frame.top, frame.right + 8, frame.bottom - 2}, taken, {}, kSmall);
}

/// Describes which parts of the scene were true.
std::string about_room(const std::string& oracle) {
  if (oracle == "none") return "with the room as estimated";
  std::string parts = oracle;
  std::replace(parts.begin(), parts.end(), '+', ',');
  return oracle == "pose+geometry+light+albedo" ? "with the true room"
                                                : "with the room as estimated but for true " + parts;
}

}  // namespace

std::vector<SettingMean> mean_over_sessions(const std::vector<BenchRow>& rows, CostKind kind) {
  const std::size_t sessions = distinct(rows, &BenchRow::session).size();
  std::vector<SettingMean> means;
  for (const BenchRow& first : rows) {
    const auto same = [&](const SettingMean& m) { return m.method == first.method && m.setting == first.setting; };
    if (std::any_of(means.begin(), means.end(), same)) continue;
    SettingMean mean{first.method, first.setting};
    std::size_t count = 0;
    for (const BenchRow& row : rows) {
      const std::optional<double> cost_ms = cost_of(row.run.moving, kind), still_ms = cost_of(row.run.still, kind);
      if (row.method != first.method || row.setting != first.setting || !cost_ms || !still_ms ||
          !std::isfinite(row.run.measures.relight_error)) {
        continue;
      }
      mean.relight_error += row.run.measures.relight_error;
      mean.cost_ms += *cost_ms;
      mean.still_cost_ms += *still_ms;
      ++count;
    }
    if (count == sessions) {
      const double n = static_cast<double>(count);
      means.push_back({mean.method, mean.setting, mean.relight_error / n, mean.cost_ms / n, mean.still_cost_ms / n});
    }
  }
  return means;
}

std::vector<std::size_t> pareto_front(const std::vector<SettingMean>& means) {
  std::vector<std::size_t> by_cost(means.size());
  std::iota(by_cost.begin(), by_cost.end(), std::size_t{0});
  std::ranges::sort(by_cost, {}, [&](std::size_t i) { return std::pair(means[i].cost_ms, means[i].relight_error); });
  std::vector<std::size_t> front;
  for (const std::size_t i : by_cost) {
    if (front.empty() || means[i].relight_error < means[front.back()].relight_error) front.push_back(i);
  }
  return front;
}

void draw_error_time(const BenchResults& results, CostKind kind, const std::filesystem::path& stem) {
  const std::vector<SettingMean> means = mean_over_sessions(results.rows, kind);
  if (means.empty()) return;
  std::vector<BenchRow> like_published;
  for (const BenchRow& row : results.rows) {
    if (row.session.starts_with(kPublishedScene) && cost_of(row.run.moving, kind) &&
        std::isfinite(row.run.measures.psnr_db)) {
      like_published.push_back(row);
    }
  }
  const bool two = !like_published.empty();
  constexpr double kWidth = 960, kHeight = 540;
  Drawing drawing(kWidth, kHeight);
  const Box left{64, 104, two ? 612 : kWidth - 24, kHeight - 74}, right{672, 104, kWidth - 24, kHeight - 74};
  const std::vector<std::string> sessions = distinct(results.rows, &BenchRow::session);
  drawing.text({20, 30}, "Error against time", {.size = 18, .bold = true});
  drawing.text(
      {20, 50},
      (sessions.size() > 1 ? "Mean over " : "") + capture::listed(sessions) + "; " + about_room(results.oracle),
      {.size = kText, .colour = kQuiet});
  const MethodStyles styles{all_methods(results.rows)};
  draw_legend(drawing, {20, 78}, distinct(means, &SettingMean::method), styles);
  draw_errors(drawing, left, means, kind, styles);
  if (two) {
    drawing.text({right.left, 78}, kPublishedScene, {.size = kText, .bold = true});
    drawing.text({right.left, 94}, "○ Franke 2015, fig. 5.19, on GPUs of its time", {.size = kSmall, .colour = kQuiet});
    draw_published(drawing, right, like_published, kind, styles);
  }
  drawing.text({20, kHeight - 12}, line_of(results.machine), {.size = kSmall, .colour = kQuiet});
  write(drawing, stem);
}

}  // namespace lumigraft::server
