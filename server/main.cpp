// lumigraft: dispatches the command line and maps exceptions to exit codes:
//   0 done, 1 failed while running, 2 the input or the command line is wrong
#include <atomic>
#include <csignal>
#include <exception>
#include <iostream>
#include <string>
#include <utility>

#ifdef LUMIGRAFT_JEMALLOC
#include <jemalloc/jemalloc.h>
#endif

#include "capture/error.h"
#include "capture/message_text.h"
#include "server/command_line.h"
#include "server/commands/devices.h"
#include "server/commands/serve.h"

namespace lumigraft::server {
namespace {

std::atomic<bool> interrupted = false;

/// Messages of libraries may contain line breaks.
std::string one_line(std::string text) {
  text.erase(text.find_last_not_of('\n') + 1);
  return capture::on_one_line(std::move(text));
}

int run(int argc, char** argv) {
  const CommandLine command = parse_command_line(argc, argv);
  if (const auto* print = std::get_if<PrintCommand>(&command)) {
    std::cout << print->text;
    return 0;
  }
  if (const auto* doctor = std::get_if<DoctorCommand>(&command)) return write_doctor_report(*doctor, std::cout) ? 0 : 1;
  if (const auto* devices = std::get_if<DevicesCommand>(&command)) {
    const auto write = devices->json ? write_devices_json : write_devices_text;
    write(std::cout, capture::list_cameras());
    return 0;
  }
  if (const auto* serve = std::get_if<ServeCommand>(&command)) {
    run_serve(serve->files, serve->listen);
    return 0;
  }
  const auto interrupt = [](int number) {
    interrupted = true;
    std::signal(number, SIG_DFL);  // a second signal ends the process without waiting for the frame
  };
  std::signal(SIGINT, interrupt);
  std::signal(SIGTERM, interrupt);
  if (const auto* bench = std::get_if<BenchCommand>(&command)) {
    if (!run_bench(*bench, interrupted)) {
      std::cerr << "lumigraft: interrupted, what was measured is in " << bench->out.string() << '\n';
      return 1;
    }
    return 0;
  }
  const auto reported = [](const auto* given, auto run) {
    if (given != nullptr) run(*given, interrupted, std::cout);
    return given != nullptr;
  };
  if (reported(std::get_if<RecordCommand>(&command), run_record) ||
      reported(std::get_if<ImportCommand>(&command), run_import) ||
      reported(std::get_if<ExportCommand>(&command), run_export) ||
      reported(std::get_if<CalibrateCommand>(&command), run_calibrate)) {
    return 0;
  }
  if (!run_replay(std::get<ReplayCommand>(command), interrupted)) {
    std::cerr << "lumigraft: interrupted, nothing was written\n";
    return 1;
  }
  return 0;
}

}  // namespace
}  // namespace lumigraft::server

#ifdef LUMIGRAFT_JEMALLOC
// The C library's allocator keeps what one of a dozen threads frees between smaller blocks that stay: of 450 MB in use,
// which did not grow, it held 740 MB after two minutes of tests/bench/soak and more later. jemalloc sorts blocks by
// size and returns unused pages, on a thread of its own also for threads that rest; docs/service.md has the figures.
// Two arenas, since each keeps what it frees for the decay time and a dozen threads on few cores contend little; the
// pages of a picture are used again by the next one within that time.
const char* malloc_conf =
    "background_thread:true,max_background_threads:1,narenas:2,dirty_decay_ms:2000,muzzy_decay_ms:0";
#endif

int main(int argc, char** argv) {
  try {
    return lumigraft::server::run(argc, argv);
  } catch (const lumigraft::capture::InputError& e) {
    std::cerr << "lumigraft: " << lumigraft::server::one_line(e.what()) << '\n';
    return 2;
  } catch (const std::exception& e) {
    std::cerr << "lumigraft: " << lumigraft::server::one_line(e.what()) << '\n';
    return 1;
  }
}
