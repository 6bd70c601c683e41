// comparators SESSION ... --out FOLDER: runs the reference methods and lumigraft on sessions with truth and the true
// room. Writes comparators.csv with the columns of bench's results.csv, and the chart of error against time.
#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <string>
#include <vector>

#include "capture/error.h"
#include "server/bench/error_time_chart.h"
#include "server/bench/tables.h"
#include "tests/bench/comparators/contenders.h"

namespace {

using namespace lumigraft;

struct Command {
  std::vector<std::filesystem::path> sessions;
  std::filesystem::path out;
};

Command parse(int argc, char** argv) {
  Command command;
  for (int i = 1; i < argc; ++i) {
    if (std::string(argv[i]) == "--out" && i + 1 < argc) {
      command.out = argv[++i];
    } else {
      command.sessions.emplace_back(argv[i]);
    }
  }
  if (command.sessions.empty() || command.out.empty())
    throw capture::InputError("usage: comparators SESSION ... --out FOLDER");
  return command;
}

void say(const server::BenchRow& row) {
  char text[256];
  std::snprintf(text, sizeof text, "relight_error %.3f, %.0f ms CPU", row.run.measures.relight_error,
                row.run.moving.host.cpu_ms);
  std::cerr << row.session << ", " << row.method << ' ' << row.setting << ": " << text << '\n';
}

void run(const Command& command) {
  std::filesystem::create_directories(command.out);
  server::CsvFile table(command.out / "comparators.csv", server::fields_of(server::BenchRow{}));
  server::BenchResults results;
  const std::shared_ptr<relight::gpu::Device> device = relight::gpu::create_device(relight::gpu::Backend::best, {});
  results.machine = server::describe_machine(*device);
  for (const std::filesystem::path& session : command.sessions) {
    const comparators::Contest contest = comparators::open_contest(session, device);
    std::vector<server::BenchRow> rows = comparators::measured(contest, comparators::cone_contenders(contest));
    const double budget_ms = rows.front().run.moving.host.cpu_ms;  // of dvct
    for (server::BenchRow& row : comparators::measured(contest, comparators::ray_contenders(contest, budget_ms))) {
      rows.push_back(std::move(row));
    }
    for (server::BenchRow& row : rows) {
      say(row);
      if (row.setting == "equal-time") std::cerr << "  with " << row.plan.samples << " paths a pixel\n";
      table.add(server::fields_of(row));
      results.oracle = row.oracle;
      results.rows.push_back(std::move(row));
    }
  }
  server::draw_error_time(results, server::CostKind::cpu, command.out / "comparators");
}

}  // namespace

int main(int argc, char** argv) {
  try {
    run(parse(argc, argv));
    return 0;
  } catch (const std::exception& e) {
    std::cerr << "comparators: " << e.what() << '\n';
    return 1;
  }
}
