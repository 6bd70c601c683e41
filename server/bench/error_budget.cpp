#include "server/bench/error_budget.h"

#include <algorithm>
#include <cmath>

#include "capture/message_text.h"
#include "server/bench/bench_session.h"
#include "server/bench/chart.h"
#include "server/pipeline/make_renderer.h"

namespace lumigraft::server {
namespace {

using namespace chart;

constexpr OracleParts kAllTrue{.pose = true, .geometry = true, .light = true, .albedo = true};

Colour colour_of_case(std::size_t index, std::size_t count) {
  return index == 0 ? Colour{0.75, 0.75, 0.75, 1} : index + 1 == count ? kInk.faded(0.75) : colour_of(index - 1);
}

}  // namespace

std::vector<BudgetCase> budget_cases() {
  std::vector<BudgetCase> cases{{"nothing", kAllTrue}};
  for (const auto& [name, part] : kOracleParts) {
    cases.push_back({name, kAllTrue});
    cases.back().oracle.*part = false;
  }
  cases.push_back({"everything", {}});
  return cases;
}

BudgetRow measure_budget(const std::shared_ptr<relight::gpu::Device>& device, const std::string& name,
                         const capture::Session& session, const relight::Exhibit& exhibit, const relight::Plan& plan,
                         const BudgetCase& budget) {
  const BenchScene scene = learn_bench_scene(session, budget.oracle, kAllTrue);
  const std::unique_ptr<relight::Renderer> renderer = make_renderer(session, plan, budget.oracle, device);
  const relight::RelitPicture picture = renderer->relight(scene.frame, scene.scene, exhibit, plan);
  const Measures measures = measure_picture(picture.srgb, scene.camera, scene.truth);
  return {name, budget.estimated, measures.relight_error, measures.object_error};
}

void draw_error_budget(const BenchResults& results, const std::filesystem::path& stem) {
  const std::vector<BudgetCase> cases = budget_cases();
  const std::vector<std::string> sessions = distinct(results.budget, &BudgetRow::session);
  double worst = 0;
  for (const BudgetRow& row : results.budget) {
    worst = std::isfinite(row.relight_error) ? std::max(worst, row.relight_error) : worst;
  }
  if (sessions.empty() || worst == 0) return;
  constexpr double kWidth = 960, kHeight = 440;
  Drawing drawing(kWidth, kHeight);
  const Box frame{64, 104, kWidth - 24, kHeight - 62};
  worst = round_up(1.08 * worst, 5);
  const Axis y{Axis::Scale::linear, 0, worst, frame.bottom, frame.top};
  const Axis x{Axis::Scale::linear, 0, static_cast<double>(sessions.size()), frame.left, frame.right};
  draw_frame(drawing, frame, x, {}, y, round_ticks(worst, 5), kText);
  drawing.text({frame.left - 44, 0.5 * (frame.top + frame.bottom)}, "relight_error",
               {.size = kText, .across = 0.5, .turn_degrees = -90});
  drawing.text({20, 30}, "Error by what is estimated", {.size = 18, .bold = true});
  drawing.text({20, 50}, "All else of the room is true; rendered with " + results.budget_setting,
               {.size = kText, .colour = kQuiet});
  Point legend{20, 78};
  for (std::size_t i = 0; i < cases.size(); ++i) {
    const std::string text = cases[i].estimated == "nothing" ? "nothing: rendering alone" : cases[i].estimated;
    drawing.fill({legend.x, legend.y - 10, legend.x + 11, legend.y + 1}, colour_of_case(i, cases.size()));
    drawing.text({legend.x + 17, legend.y}, text, {.size = kText});
    legend.x += 37 + drawing.text_width(text, {.size = kText});
  }
  for (std::size_t s = 0; s < sessions.size(); ++s) {
    const double left = x.at(static_cast<double>(s)), width = x.at(1) - x.at(0);
    const double bar = std::min(46.0, 0.8 * width / static_cast<double>(cases.size()));
    const double first = left + 0.5 * (width - bar * static_cast<double>(cases.size()));
    drawing.text({left + 0.5 * width, frame.bottom + 22}, sessions[s], {.size = kText, .bold = true, .across = 0.5});
    for (const BudgetRow& row : results.budget) {
      if (row.session != sessions[s] || !std::isfinite(row.relight_error)) continue;
      const auto of = std::ranges::find(cases, row.estimated, &BudgetCase::estimated);
      const std::size_t i = static_cast<std::size_t>(of - cases.begin());
      const double at = first + bar * static_cast<double>(i), top = y.at(row.relight_error);
      drawing.fill({at + 1.5, top, at + bar - 1.5, frame.bottom}, colour_of_case(i, cases.size()));
      if (i == 0) {
        drawing.line({{first, top}, {first + bar * static_cast<double>(cases.size()), top}}, {kQuiet.faded(0.6), 1, 3});
      }
      drawing.text({at + 0.5 * bar, top - 4}, capture::formatted("%.3f", row.relight_error),
                   {.size = bar < 34 ? 8.5 : kSmall, .colour = kInk, .across = 0.5});
    }
  }
  drawing.text({20, kHeight - 12}, results.machine.device + "; " + results.machine.program,
               {.size = kSmall, .colour = kQuiet});
  write(drawing, stem);
}

}  // namespace lumigraft::server
