#pragma once
// Parses the command line into a value; main() only dispatches it.
#include <string>
#include <variant>

#include "server/bench/bench.h"
#include "server/commands/calibrate.h"
#include "server/commands/doctor/doctor.h"
#include "server/commands/record.h"
#include "server/commands/replay.h"
#include "server/commands/tum.h"
#include "server/pipeline/service_config.h"

namespace lumigraft::server {

struct ServeCommand {
  ServiceFiles files;
  std::string listen;  ///< empty: as configured
};
struct DevicesCommand {
  bool json = false;
};
struct PrintCommand {  ///< --help, --version, --set help: text for stdout
  std::string text;
};
using CommandLine = std::variant<ServeCommand, ReplayCommand, RecordCommand, ImportCommand, ExportCommand,
                                 CalibrateCommand, BenchCommand, DoctorCommand, DevicesCommand, PrintCommand>;

/// Throws InputError with a one-line message.
CommandLine parse_command_line(int argc, const char* const* argv);

}  // namespace lumigraft::server
