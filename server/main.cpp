// lumigraft: dispatches the command line and maps exceptions to exit codes:
//   0 done, 1 failed while running, 2 the input or the command line is wrong
#include <algorithm>
#include <atomic>
#include <csignal>
#include <exception>
#include <iostream>
#include <string>

#include "capture/error.h"
#include "server/command_line.h"
#include "server/commands/devices.h"
#include "server/commands/doctor.h"
#include "server/commands/serve.h"

namespace {

std::atomic<bool> interrupted = false;

/// Joins a message into one line: messages of libraries may contain line breaks.
std::string one_line(std::string text) {
  while (!text.empty() && text.back() == '\n') {
    text.pop_back();
  }
  std::replace(text.begin(), text.end(), '\n', ' ');
  return text;
}

int run(int argc, char** argv) {
  const lumigraft::server::CommandLine command = lumigraft::server::parse_command_line(argc, argv);
  if (const auto* print = std::get_if<lumigraft::server::PrintCommand>(&command)) {
    std::cout << print->text;
    return 0;
  }
  if (std::holds_alternative<lumigraft::server::DoctorCommand>(command)) {
    return lumigraft::server::write_doctor_report(std::cout) ? 0 : 1;
  }
  if (const auto* devices = std::get_if<lumigraft::server::DevicesCommand>(&command)) {
    const auto write = devices->json ? lumigraft::server::write_devices_json : lumigraft::server::write_devices_text;
    write(std::cout, lumigraft::capture::list_cameras());
    return 0;
  }
  if (const auto* serve = std::get_if<lumigraft::server::ServeCommand>(&command)) {
    lumigraft::server::run_serve(serve->files, serve->listen);
    return 0;
  }
  const auto interrupt = [](int number) {
    interrupted = true;
    std::signal(number, SIG_DFL);  // a second signal ends the process without waiting for the frame
  };
  std::signal(SIGINT, interrupt);
  std::signal(SIGTERM, interrupt);
  if (const auto* bench = std::get_if<lumigraft::server::BenchCommand>(&command)) {
    if (!lumigraft::server::run_bench(*bench, interrupted)) {
      std::cerr << "lumigraft: interrupted, what was measured is in " << bench->out.string() << '\n';
      return 1;
    }
    return 0;
  }
  if (const auto* record = std::get_if<lumigraft::server::RecordCommand>(&command)) {
    lumigraft::server::run_record(*record, interrupted, std::cout);
    return 0;
  }
  if (const auto* import = std::get_if<lumigraft::server::ImportCommand>(&command)) {
    lumigraft::server::run_import(*import, interrupted, std::cout);
    return 0;
  }
  if (const auto* exported = std::get_if<lumigraft::server::ExportCommand>(&command)) {
    lumigraft::server::run_export(*exported, interrupted, std::cout);
    return 0;
  }
  if (const auto* calibrate = std::get_if<lumigraft::server::CalibrateCommand>(&command)) {
    lumigraft::server::run_calibrate(*calibrate, interrupted, std::cout);
    return 0;
  }
  if (!lumigraft::server::run_replay(std::get<lumigraft::server::ReplayCommand>(command), interrupted)) {
    std::cerr << "lumigraft: interrupted, nothing was written\n";
    return 1;
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run(argc, argv);
  } catch (const lumigraft::capture::InputError& e) {
    std::cerr << "lumigraft: " << one_line(e.what()) << '\n';
    return 2;
  } catch (const std::exception& e) {
    std::cerr << "lumigraft: " << one_line(e.what()) << '\n';
    return 1;
  }
}
