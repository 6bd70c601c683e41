#include "server/bench/bench.h"

#include <algorithm>
#include <cmath>
#include <iostream>
#include <set>
#include <utility>

#include "capture/error.h"
#include "capture/message_text.h"
#include "relight/objects/mesh_simplify.h"
#include "server/bench/bench_session.h"
#include "server/bench/error_budget.h"
#include "server/bench/error_time_chart.h"
#include "server/bench/resize.h"
#include "server/bench/settings.h"
#include "server/bench/tables.h"
#include "server/bench/work.h"
#include "server/pipeline/make_renderer.h"

namespace lumigraft::server {
namespace {

namespace fs = std::filesystem;

struct Method {
  std::string name;
  std::vector<BenchSetting> settings;
};

struct NamedInput {
  std::string name;  ///< the session's name, with a number appended where it is not unique
  ServiceInput input;
};

/// What is measured on one session.
struct SessionWork {
  const NamedInput* session;
  std::vector<Method> methods;
};

const std::string kErrorTime = "error-time", kCostWork = "cost-work", kErrorBudget = "error-budget";

bool contains(const std::vector<std::string>& words, const std::string& word) {
  return std::find(words.begin(), words.end(), word) != words.end();
}

void check_words(const char* option, const std::vector<std::string>& found, const std::vector<std::string>& allowed) {
  for (const std::string& word : found) {
    capture::refuse_if(!contains(allowed, word),
                       std::string(option) + ": found \"" + word + "\", allowed: " + capture::listed(allowed));
  }
}

std::vector<Method> choose_methods(const BenchCommand& command) {
  check_words("--methods", command.methods, relight::plan_methods());
  std::vector<Method> chosen;
  std::vector<std::string> names;
  for (const std::string& name : relight::plan_methods()) {
    if (!command.methods.empty() && !contains(command.methods, name)) continue;
    Method method{name, {}};
    for (BenchSetting& setting : bench_settings(name)) {
      names.push_back(setting.name);
      if (command.settings.empty() || contains(command.settings, setting.name)) {
        method.settings.push_back(std::move(setting));
      }
    }
    chosen.push_back(std::move(method));
  }
  check_words("--settings", command.settings, names);
  return chosen;
}

bool wants(const BenchCommand& command, const std::string& chart) {
  if (command.charts.empty()) return !command.shard || chart == kErrorTime;
  return contains(command.charts, chart);
}

std::vector<NamedInput> open_sessions(const BenchCommand& command) {
  std::vector<NamedInput> sessions;
  std::set<std::string> taken;
  for (const fs::path& folder : command.sessions) {
    ServiceInput input =
        open_bench_session(folder, wants(command, kErrorBudget) ? budget_cases().front().oracle : command.oracle);
    for (const std::string& warning : input.warnings) std::cerr << "lumigraft: " << warning << '\n';
    std::string name = input.session.name;
    for (int n = 2; !taken.insert(name).second; ++n) name = input.session.name + "-" + std::to_string(n);
    sessions.push_back({std::move(name), std::move(input)});
  }
  return sessions;
}

void make_folder(const fs::path& out) {
  std::error_code error;
  fs::create_directories(out, error);
  capture::refuse_if(error || !fs::is_directory(out),
                     "--out: " + out.string() + " cannot be created, allowed: a folder, existing or not");
}

void say(const BenchRow& row, std::size_t done, std::size_t all) {
  const std::string run = row.session + ", " + row.method + ' ' + row.setting + ": ";
  std::cerr << "lumigraft: " << done << '/' << all << ' ' << run
            << capture::formatted("relight_error %.3f, %.0f ms CPU, %.0f ms wall", row.run.measures.relight_error,
                                  row.run.moving.host.cpu_ms, row.run.moving.host.wall_ms)
            << '\n';
  for (const std::string& warning : row.run.warnings) std::cerr << "lumigraft: " << run << warning << '\n';
}

relight::Exhibit simplified(relight::Exhibit exhibit, int max_triangles) {
  for (relight::VirtualObject& object : exhibit.objects) {
    if (max_triangles > 0) object.model = relight::simplify_model(*object.model, max_triangles);
  }
  return exhibit;
}

/// The command's part of sessions × methods × settings, without sessions of which nothing is left.
std::vector<SessionWork> divide_work(const BenchCommand& command, const std::vector<NamedInput>& sessions,
                                     const std::vector<Method>& methods) {
  std::vector<double> run_s;
  for (std::size_t i = 0; i < sessions.size(); ++i) {
    for (const Method& method : methods) {
      for (const BenchSetting& setting : method.settings) run_s.push_back(setting.run_s);
    }
  }
  const std::vector<bool> chosen = rows_of(command.shard.value_or(Shard{}), run_s);
  std::vector<SessionWork> work;
  std::size_t row = 0;
  for (const NamedInput& session : sessions) {
    SessionWork part{&session, {}};
    for (const Method& method : methods) {
      Method some{method.name, {}};
      for (const BenchSetting& setting : method.settings) {
        if (chosen[row++]) some.settings.push_back(setting);
      }
      if (!some.settings.empty()) part.methods.push_back(std::move(some));
    }
    if (!part.methods.empty()) work.push_back(std::move(part));
  }
  return work;
}

/// Runs every setting on every session; results are stored after each run. False when interrupted.
bool measure_settings(const BenchCommand& command, const std::vector<SessionWork>& work,
                      const std::shared_ptr<relight::gpu::Device>& device, const std::atomic<bool>& interrupted,
                      BenchResults& results) {
  CsvFile table(command.out / "results.csv", fields_of(BenchRow{}));
  CsvFile stages(command.out / "stages.csv", fields_of("", "", {}));
  CsvFile passes(command.out / "passes.csv", fields_of(BenchRow{}, {}));
  std::size_t all = 0;
  for (const SessionWork& part : work) {
    for (const Method& method : part.methods) all += method.settings.size();
  }
  for (const auto& [named, methods] : work) {
    const auto& [name, input] = *named;
    BenchScene scene = learn_bench_scene(input.session, command.oracle, command.oracle);
    capture::Session session = input.session;
    resize_picture(command.enlarge, session.color.model, scene.frame);
    const relight::Exhibit exhibit = simplified(input.exhibit, command.triangles);
    for (const std::string& warning : scene.warnings) std::cerr << "lumigraft: " << name << ": " << warning << '\n';
    results.stages[name] = scene.stages;
    for (const auto& [stage, cost] : scene.stages) stages.add(fields_of(name, stage, cost));
    for (const Method& method : methods) {
      std::unique_ptr<relight::Renderer> renderer;  // shared by all settings of a method
      for (const BenchSetting& setting : method.settings) {
        if (interrupted) return false;
        if (!renderer) renderer = make_renderer(session, setting.plan, command.oracle, device);
        BenchRow row{name, method.name, setting.name, results.oracle, setting.plan, {}};
        row.run =
            run_setting(*renderer, scene, exhibit, setting.plan, results.machine.hardware && setting.plan.on_device());
        table.add(fields_of(row));
        for (const relight::gpu::PassTime& pass : row.run.moving.passes) passes.add(fields_of(row, pass));
        results.rows.push_back(std::move(row));
        say(results.rows.back(), results.rows.size(), all);
      }
    }
  }
  return true;
}

/// Varies the work on the first session, with the plan of serve.
bool measure_work(const BenchCommand& command, const NamedInput& session,
                  const std::shared_ptr<relight::gpu::Device>& device, const std::atomic<bool>& interrupted,
                  BenchResults& results) {
  CsvFile table(command.out / "cost_work.csv", fields_of(WorkRow{}));
  const BenchScene scene = learn_bench_scene(session.input.session, command.oracle, command.oracle);
  results.work_session = session.name;
  results.work_setting = "the plan of serve";
  for (const WorkCase& work : work_cases(session.input.session, scene, session.input.exhibit, interactive_plan())) {
    if (interrupted) return false;
    const auto same = std::ranges::find(results.work, true, &WorkRow::base);
    FrameCost cost;
    if (work.base && same != results.work.end()) {
      cost = same->cost;
    } else {
      const std::unique_ptr<relight::Renderer> renderer =
          make_renderer(work.session, work.plan, command.oracle, device);
      cost = cost_of_turning(*renderer, work.frame, work.scene, work.exhibit, work.plan, results.machine.hardware);
    }
    results.work.push_back({work.work, work.amount, work.base, cost});
    table.add(fields_of(results.work.back()));
    std::cerr << "lumigraft: cost of " << std::llround(work.amount) << ' ' << work.work << ": "
              << std::llround(cost.host.cpu_ms) << " ms CPU\n";
  }
  return true;
}

bool measure_budgets(const BenchCommand& command, const std::vector<NamedInput>& sessions,
                     const std::shared_ptr<relight::gpu::Device>& device, const std::atomic<bool>& interrupted,
                     BenchResults& results) {
  CsvFile table(command.out / "error_budget.csv", fields_of(BudgetRow{}));
  results.budget_setting = "the plan of replay";
  for (const auto& [name, input] : sessions) {
    for (const BudgetCase& budget : budget_cases()) {
      if (interrupted) return false;
      results.budget.push_back(measure_budget(device, name, input.session, input.exhibit, replay_plan(), budget));
      const BudgetRow& row = results.budget.back();
      table.add(fields_of(row));
      std::cerr << "lumigraft: " << name << ", estimated: " << row.estimated << ": relight_error " << row.relight_error
                << '\n';
    }
  }
  return true;
}

void write_down(const fs::path& out, const BenchResults& results) {
  write_results_json(out / "results.json", results);
  draw_error_time(results, CostKind::cpu, out / "error_time");
  if (results.machine.hardware) draw_error_time(results, CostKind::gpu, out / "error_gpu_time");
  draw_cost_work(results, out / "cost_work");
  draw_error_budget(results, out / "error_budget");
}

}  // namespace

bool run_bench(const BenchCommand& command, const std::atomic<bool>& interrupted) {
  const std::vector<std::string> charts =
      command.shard ? std::vector{kErrorTime} : std::vector{kErrorTime, kCostWork, kErrorBudget};
  check_words(command.shard ? "--charts with --shard" : "--charts", command.charts, charts);
  const std::vector<Method> methods = choose_methods(command);
  const std::vector<NamedInput> sessions = open_sessions(command);
  make_folder(command.out);
  const std::shared_ptr<relight::gpu::Device> device =
      relight::gpu::create_device(command.backend, relight::gpu::DeviceOptions{});
  BenchResults results;
  results.machine = describe_machine(*device);
  results.oracle = name_of(command.oracle);
  results.enlarged = command.enlarge;
  results.max_triangles = command.triangles;
  const bool done =
      (!wants(command, kErrorTime) ||
       measure_settings(command, divide_work(command, sessions, methods), device, interrupted, results)) &&
      (!wants(command, kErrorBudget) || measure_budgets(command, sessions, device, interrupted, results)) &&
      (!wants(command, kCostWork) || measure_work(command, sessions.front(), device, interrupted, results));
  write_down(command.out, results);
  return done;
}

}  // namespace lumigraft::server
