#include "server/command_line.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <limits>

#include "capture/error.h"
#include "capture/message_text.h"
#include "server/metrics/version.h"

namespace lumigraft::server {
namespace {

void check_overrides(const std::vector<std::string>& overrides) {
  for (const std::string& line : overrides) {
    if (const std::size_t equals = line.find('='); equals == std::string::npos || equals == 0) {
      throw capture::InputError("--set: found \"" + line + "\", allowed: KEY=VALUE, or help to list the keys");
    }
  }
}

void need(bool there, const std::string& command, const std::string& what) {
  capture::refuse_if(!there, command + ": " + what + " must be there (lumigraft " + command + " --help)");
}

}  // namespace

CommandLine parse_command_line(int argc, const char* const* argv) {
  CLI::App app("lumigraft grafts virtual objects into a live camera picture, light included.", "lumigraft");
  app.set_version_flag("--version", version_line());
  app.require_subcommand(0, 1);

  ServeCommand serve;
  ReplayCommand replay;
  RecordCommand record;
  ImportCommand import;
  ExportCommand exported;
  CalibrateCommand calibrate;
  BenchCommand bench;
  std::string oracle, backend, shard;
  std::vector<const std::vector<std::string>*> set;
  const auto add_set = [&set](CLI::App& command, std::vector<std::string>& overrides) {
    set.push_back(&overrides);
    command.add_option("--set", overrides, "KEY=VALUE over any key of the session or configuration; help lists them")
        ->allow_extra_args(false);
  };

  const auto add_backend = [&backend](CLI::App& command) {
    command.add_option("--backend", backend, "What draws; best: a hardware GPU before software, Vulkan before EGL")
        ->check(CLI::IsMember({"best", "vulkan", "egl"}));
  };

  CLI::App& serve_app = *app.add_subcommand("serve", "Stream relit pictures to browsers");
  auto* config = serve_app.add_option("--config", serve.files.config, "Configuration of a kiosk (TOML)");
  serve_app.add_option("--session", serve.files.session, "A recorded session's folder, played in a loop")
      ->excludes(config);
  serve_app.add_option("--exhibit", serve.files.exhibit, "Virtual objects, in place of the session's own exhibit.toml");
  serve_app.add_option("--listen", serve.listen,
                       "ADDRESS:PORT; 127.0.0.1:8080 unless the configuration says otherwise");
  add_backend(serve_app);
  add_set(serve_app, serve.files.overrides);

  CLI::App& replay_app = *app.add_subcommand("replay", "Turn a recorded session into pictures, frame by frame");
  replay_app.add_option("SESSION", replay.files.session, "The session's folder");
  replay_app.add_option("--out", replay.out, "Folder for frame_000000.png ... and frames.jsonl");
  replay_app.add_option("--exhibit", replay.files.exhibit,
                        "Virtual objects, in place of the session's own exhibit.toml");
  replay_app.add_option("--from", replay.from_s, "Begin at this second of the recording")->check(CLI::Range(0.0, 1e6));
  replay_app.add_option("--frames", replay.frames, "Only the first N colour frames")
      ->check(CLI::Range(1, std::numeric_limits<int>::max()));
  add_backend(replay_app);
  replay_app.add_option("--oracle", oracle, "Parts taken from the session's truth/: pose,geometry,light,albedo");
  replay_app.add_flag("--dump", replay.dump,
                      "Also write albedo, normals, depth, delta and mask as EXR, and the room's surface as PLY");
  add_set(replay_app, replay.files.overrides);

  CLI::App& record_app = *app.add_subcommand("record", "Write what the cameras give as a session that replays");
  auto* record_config = record_app.add_option("--config", record.files.config, "Configuration of a kiosk (TOML)");
  record_app.add_option("SESSION", record.files.session, "A folder whose session.toml names the cameras")
      ->excludes(record_config);
  record_app.add_option("--out", record.out, "Folder for the session, new or empty");
  record_app.add_option("--seconds", record.seconds, "How long; until interrupted or the end where not given")
      ->check(CLI::PositiveNumber);
  add_set(record_app, record.files.overrides);

  CLI::App& import_app = *app.add_subcommand("import", "Turn another program's recording into a session");
  import_app.add_option("RECORDING", import.from, "A folder in TUM's layout (rgb.txt, depth.txt), or an .oni file");
  import_app.add_option("--out", import.out, "Folder for the session, new or empty");
  import_app
      .add_option("--set", import.overrides, "KEY=VALUE of the session: what the recording does not say, as color.fx")
      ->allow_extra_args(false);

  CLI::App& export_app = *app.add_subcommand("export", "Turn a recorded session into a folder in TUM's layout");
  export_app.add_option("SESSION", exported.session, "The session's folder");
  export_app.add_option("--out", exported.out, "The folder, new or empty");
  add_set(export_app, exported.overrides);

  CLI::App& calibrate_app = *app.add_subcommand("calibrate", "Find lenses and places of cameras from a printed board");
  calibrate_app.add_option("--board", calibrate.board, "The board that is shown (TOML)");
  calibrate_app.add_option("--draw", calibrate.draw, "Draw the board to this file (SVG), to print it");
  auto* calibrate_config =
      calibrate_app.add_option("--config", calibrate.files.config, "Configuration of a kiosk (TOML)");
  auto* calibrate_session =
      calibrate_app.add_option("SESSION", calibrate.files.session, "A recorded session that shows the board")
          ->excludes(calibrate_config);
  for (auto* option :
       {calibrate_app.add_option("--color", calibrate.color, "A folder of a colour camera's pictures"),
        calibrate_app.add_option("--fisheye", calibrate.fisheye,
                                 "A folder of a fish-eye's pictures, those of one moment of one name")}) {
    option->excludes(calibrate_config)->excludes(calibrate_session);
  }
  calibrate_app.add_option(
      "--sweep", calibrate.sweep,
      "For the response: a list of pictures of a still scene, \"time path exposure\" in each line");
  calibrate_app.add_option("--fov-degrees", calibrate.fov_degrees, "Of the fish-eye in --fisheye")
      ->check(CLI::Range(1.0, 360.0));
  calibrate_app.add_option("--seconds", calibrate.seconds, "How long to look through live cameras")
      ->check(CLI::PositiveNumber);
  calibrate_app.add_option("--listen", calibrate.listen, "ADDRESS:PORT of a page that guides whoever holds the board");
  calibrate_app.add_option("--out", calibrate.out, "The calibration file");
  add_set(calibrate_app, calibrate.files.overrides);

  CLI::App& bench_app = *app.add_subcommand("bench", "Chart error against time, on sessions with truth");
  bench_app.add_option("SESSION", bench.sessions, "The sessions' folders");
  bench_app.add_option("--out", bench.out, "Folder for results.csv, results.json and charts");
  bench_app.add_option("--oracle", oracle, "Parts taken from the sessions' truth/: pose,geometry,light,albedo");
  bench_app.add_option("--methods", bench.methods, "Only these, as dvct; with commas between")->delimiter(',');
  bench_app.add_option("--settings", bench.settings, "Only these, as live-64; with commas between")->delimiter(',');
  bench_app.add_option("--charts", bench.charts, "Only these: error-time, cost-work, error-budget")->delimiter(',');
  auto* shard_option =
      bench_app.add_option("--shard", shard, "K/N: only the K-th of N parts of the rows, for error-time");
  bench_app.add_option("--enlarge", bench.enlarge, "Pictures with N pixels along each edge for one of the camera's")
      ->check(CLI::IsMember({1, 2, 4}));
  bench_app.add_option("--triangles", bench.triangles, "Objects with more are simplified to so many")
      ->check(CLI::Range(12, 10000000));
  add_backend(bench_app);

  CLI::App& doctor_app =
      *app.add_subcommand("doctor", "Say what this machine offers, what is in the way, and what mends it");
  DoctorCommand doctor;
  doctor_app.add_option("--config", doctor.config,
                        "Also check this configuration of a kiosk (TOML), as serve would find it");
  DevicesCommand devices;
  CLI::App& devices_app = *app.add_subcommand("devices", "List the cameras with their formats and controls");
  devices_app.add_flag("--json", devices.json, "For programs");

  try {
    app.parse(argc, argv);
  } catch (const CLI::CallForHelp&) {
    return PrintCommand{app.help("", CLI::AppFormatMode::Normal)};
  } catch (const CLI::CallForVersion&) {
    return PrintCommand{version_line() + "\n"};
  } catch (const CLI::ParseError& e) {
    throw capture::InputError(capture::on_one_line(e.what()) + " (lumigraft --help)");
  }

  if (doctor_app.parsed()) return doctor;
  if (devices_app.parsed()) return devices;
  for (const auto* overrides : set) {
    if (std::find(overrides->begin(), overrides->end(), "help") != overrides->end()) {
      return PrintCommand{settable_keys()};
    }
    check_overrides(*overrides);
  }
  for (auto* overrides : {&serve.files.overrides, &replay.files.overrides}) {
    if (!backend.empty()) overrides->push_back("server.backend=" + backend);
  }
  if (serve_app.parsed()) {
    need(!serve.files.config.empty() || !serve.files.session.empty(), "serve", "--config FILE or --session DIR");
    return serve;
  }
  if (replay_app.parsed()) {
    need(!replay.files.session.empty() && !replay.out.empty(), "replay", "SESSION and --out DIR");
    replay.oracle = parse_oracle_parts(oracle);
    return replay;
  }
  if (record_app.parsed()) {
    need((!record.files.session.empty() || !record.files.config.empty()) && !record.out.empty(), "record",
         "SESSION or --config FILE, and --out DIR");
    return record;
  }
  if (import_app.parsed()) {
    check_overrides(import.overrides);
    need(!import.from.empty() && !import.out.empty(), "import", "RECORDING and --out DIR");
    return import;
  }
  if (export_app.parsed()) {
    need(!exported.session.empty() && !exported.out.empty(), "export", "SESSION and --out DIR");
    return exported;
  }
  if (calibrate_app.parsed()) {
    const bool pictures = !calibrate.files.session.empty() || !calibrate.files.config.empty() ||
                          !calibrate.color.empty() || !calibrate.fisheye.empty();
    const bool sweep = !calibrate.sweep.empty();
    capture::refuse_if(!calibrate.listen.empty() && calibrate.files.session.empty() && calibrate.files.config.empty(),
                       "calibrate: --listen goes with SESSION or --config FILE (lumigraft calibrate --help)");
    need(sweep ? calibrate.board.empty() && !pictures && !calibrate.out.empty()
               : !calibrate.board.empty() && pictures != calibrate.out.empty() && (pictures || !calibrate.draw.empty()),
         "calibrate",
         "--board FILE, and --draw FILE or pictures (SESSION, --config FILE, --color DIR, --fisheye DIR) with --out "
         "FILE, or --sweep LIST with --out FILE");
    return calibrate;
  }
  if (bench_app.parsed()) {
    need(!bench.sessions.empty() && !bench.out.empty(), "bench", "SESSION... and --out DIR");
    bench.oracle = parse_oracle_parts(oracle);
    if (shard_option->count() > 0) bench.shard = parse_shard(shard);
    bench.backend = relight::gpu::backend_named(backend).value_or(relight::gpu::Backend::best);
    return bench;
  }
  capture::refuse_if(argc > 1, "found no command (lumigraft --help)");
  return PrintCommand{app.help("", CLI::AppFormatMode::Normal)};
}

}  // namespace lumigraft::server
