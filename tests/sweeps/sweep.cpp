#include "tests/sweeps/sweep.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>

#include "capture/camera/srgb.h"
#include "relight/reference/reference_renderer.h"
#include "server/bench/chart.h"

namespace lumigraft::test {
namespace {

constexpr double kMinWidth = 720, kHeight = 400, kText = 12;
constexpr server::Box kFrame{70, 44, 540, 344};
constexpr double kLegend = 46;  ///< from the frame to the text of the legend

void write_table(const Sweep& sweep, const std::filesystem::path& path) {
  std::ofstream out(path);
  out << sweep.x_label;
  for (const Curve& curve : sweep.curves) out << ',' << curve.name;
  out << '\n';
  for (std::size_t i = 0; i < sweep.x.size(); ++i) {
    char text[32];
    std::snprintf(text, sizeof text, "%.6g", sweep.x[i]);
    out << text;
    for (const Curve& curve : sweep.curves) {
      std::snprintf(text, sizeof text, "%.5g", curve.y.at(i));
      out << ',' << text;
    }
    out << '\n';
  }
}

std::vector<server::chart::Tick> ticks_of(const Sweep& sweep) {
  std::vector<server::chart::Tick> ticks;
  const std::size_t step = sweep.x.size() > 8 ? 2 : 1;
  for (std::size_t i = 0; i < sweep.x.size(); i += step) {
    char text[32];
    std::snprintf(text, sizeof text, "%g", sweep.x[i]);
    ticks.push_back({sweep.x[i], text});
  }
  return ticks;
}

/// Ticks in round steps from the lowest value to the highest, including 0.
std::vector<server::chart::Tick> ticks_between(double low, double high) {
  const std::vector<server::chart::Tick> up = server::chart::round_ticks(std::max(high, -low), 6);
  std::vector<server::chart::Tick> ticks;
  for (const server::chart::Tick& tick : up) {
    if (tick.value <= high * (1 + 1e-9)) ticks.push_back(tick);
    if (tick.value > 0 && -tick.value >= low * (1 + 1e-9)) ticks.push_back({-tick.value, "-" + tick.label});
  }
  return ticks;
}

/// Of a chart with all of its legend.
double width_of(const Sweep& sweep) {
  const server::Drawing any(1, 1);
  double width = kMinWidth;
  for (const Curve& curve : sweep.curves)
    width = std::max(width, kFrame.right + kLegend + any.text_width(curve.name, {.size = kText}) + 12);
  return width;
}

void draw(const Sweep& sweep, const std::filesystem::path& stem) {
  double low = 0, high = 1e-9;
  const auto take = [&](double y) {
    if (!std::isfinite(y)) return;
    low = std::min(low, y);
    high = std::max(high, y);
  };
  for (const Curve& curve : sweep.curves) std::for_each(curve.y.begin(), curve.y.end(), take);
  take(sweep.min);
  take(sweep.max);
  high = server::chart::round_up(high, 6);
  low = low < 0 ? -server::chart::round_up(-low, 6) : 0;

  const auto scale = sweep.logarithmic ? server::chart::Axis::Scale::logarithmic : server::chart::Axis::Scale::linear;
  const server::chart::Axis x{scale, sweep.x.front(), sweep.x.back(), kFrame.left + 8, kFrame.right - 8};
  const server::chart::Axis y{server::chart::Axis::Scale::linear, low, high, kFrame.bottom, kFrame.top};
  server::Drawing drawing(width_of(sweep), kHeight);
  drawing.text({kFrame.left, 24}, sweep.title, {.size = 14, .bold = true});
  server::chart::draw_frame(drawing, kFrame, x, ticks_of(sweep), y, ticks_between(low, high), kText);
  drawing.text({0.5 * (kFrame.left + kFrame.right), kFrame.bottom + 38}, sweep.x_label, {.size = kText, .across = 0.5});
  drawing.text({18, 0.5 * (kFrame.top + kFrame.bottom)}, sweep.y_label,
               {.size = kText, .across = 0.5, .turn_degrees = -90});
  for (const double bound : {sweep.min, sweep.max}) {
    if (!std::isfinite(bound)) continue;
    const double at = y.at(bound);
    drawing.line({{kFrame.left, at}, {kFrame.right, at}}, {server::chart::kQuiet, 1.2, 2});
  }
  double row = kFrame.top + 8;
  const auto legend = [&](const std::string& name, const server::Stroke& stroke) {
    drawing.line({{kFrame.right + 16, row - 4}, {kFrame.right + 40, row - 4}}, stroke);
    drawing.text({kFrame.right + kLegend, row}, name, {.size = kText, .colour = server::chart::kInk});
    row += 20;
  };
  std::size_t index = 0;
  for (const Curve& curve : sweep.curves) {
    const server::Colour colour = curve.answer ? server::chart::kInk : server::chart::colour_of(index);
    const server::Stroke stroke{colour, 2, curve.answer ? 6.0 : 0.0};
    std::vector<server::Point> points;
    for (std::size_t i = 0; i < sweep.x.size(); ++i) points.push_back({x.at(sweep.x[i]), y.at(curve.y.at(i))});
    drawing.line(points, stroke);
    for (const server::Point& point : points) {
      if (!curve.answer) drawing.mark(server::chart::mark_of(index), point, 3.5, colour);
    }
    legend(curve.name, stroke);
    if (!curve.answer) ++index;
  }
  if (std::isfinite(sweep.min) || std::isfinite(sweep.max))
    legend("bound of the test", {server::chart::kQuiet, 1.2, 2});
  server::chart::write(drawing, stem);
}

}  // namespace

std::vector<Method> methods(int volume, int bounces) {
  std::vector<Method> all{{"cones, careful", careful_plan(volume, bounces)},
                          {"cones, live", careful_plan(volume, bounces)},
                          {"propagation", careful_plan(volume, bounces)}};
  all[1].plan.trace_scale = 4;
  all[2].plan.method = "dlpv";
  all[2].plan.lpv_steps = 32;
  return all;
}

relight::RelitPicture reference(const ClosedScene& scene, int samples) {
  relight::Plan plan;
  plan.method = "reference";
  plan.samples = samples;
  relight::ReferenceRenderer renderer(scene.session());
  return renderer.relight(scene.frame(), scene.scene(), scene.exhibit, plan, true);
}

void write_sweep(const Sweep& sweep) {
  const char* const folder = std::getenv("LUMIGRAFT_SWEEPS");
  if (!folder) return;
  std::filesystem::create_directories(folder);
  const std::filesystem::path stem = std::filesystem::path(folder) / sweep.stem;
  write_table(sweep, stem.string() + ".csv");
  draw(sweep, stem);
}

relight::RelitPicture SweepTest::relit(const ClosedScene& scene, const relight::Plan& plan) {
  const capture::CameraModel model = scene.session().color.model;
  if (!relighter_ || model.width != model_.width || model.height != model_.height || model.fx != model_.fx) {
    relighter_ = std::make_unique<relight::Relighter>(device_, scene.session());
    model_ = model;
  }
  return scene.relit(*relighter_, plan);
}

relight::RelitPicture SweepTest::served(const ClosedScene& scene, const relight::Plan& plan) {
  relight::RelitPicture picture = relit(scene, plan);
  if (plan.trace_scale != 4) return picture;
  const capture::FrameSet frame = scene.frame();
  const relight::RelitPicture served = relighter_->relight(frame, scene.scene(), scene.exhibit, plan);
  auto maps = std::make_shared<relight::RelightMaps>(*picture.maps);
  for (std::size_t i = 0; i < served.srgb.data.size(); ++i) {
    const float before = frame.color->radiance.data[i], code = served.srgb.data[i];
    const bool same = code == std::round(255 * capture::linear_to_srgb(before));
    maps->delta.data[i] = same ? 0.0f : capture::srgb_to_linear(code / 255) - before;
  }
  picture.maps = maps;
  return picture;
}

void SweepTest::expect_within_bounds(const Sweep& sweep) const {
  write_sweep(sweep);
  for (const Curve& curve : sweep.curves) {
    ASSERT_EQ(curve.y.size(), sweep.x.size()) << curve.name;
    for (std::size_t i = 0; i < sweep.x.size() && !curve.answer; ++i) {
      const std::string where = curve.name + " at " + std::to_string(sweep.x[i]) + " " + sweep.x_label;
      EXPECT_TRUE(std::isfinite(curve.y[i])) << where;
      if (!std::isnan(sweep.min)) {
        EXPECT_GE(curve.y[i], sweep.min) << where;
      }
      if (!std::isnan(sweep.max)) {
        EXPECT_LE(curve.y[i], sweep.max) << where;
      }
    }
  }
}

}  // namespace lumigraft::test
