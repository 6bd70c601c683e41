#pragma once
// All that is read from files and from the command line before anything starts.
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "capture/session/session.h"
#include "capture/session/session_text.h"
#include "relight/exhibit/exhibit.h"
#include "relight/gpu/device.h"
#include "relight/plan.h"

namespace lumigraft::server {

struct ServerSettings {
  std::string address = "127.0.0.1";
  std::uint16_t port = 8080;  ///< 0: any free one
  int max_viewers = 64;
  int jpeg_quality = 85;
  std::filesystem::path recordings;                             ///< where the page may record to; empty: it may not
  relight::gpu::Backend backend = relight::gpu::Backend::best;  ///< of replay too
};

/// ADDRESS:PORT with a numeric address, [::1]:PORT, localhost:PORT, or :PORT alone. `where` begins the error's line.
void read_listen(const std::string& text, const std::string& where, ServerSettings& settings);

struct ServiceFiles {
  std::filesystem::path config;   ///< empty: the session's own session.toml
  std::filesystem::path session;  ///< a folder; empty: the configuration says
  std::filesystem::path
      exhibit;  ///< empty: the configuration's, else the session's own exhibit.toml where there is one
  std::vector<std::string> overrides;  ///< KEY=VALUE
};

struct ServiceInput {
  capture::Session session;
  capture::SessionText session_text;  ///< what `session` was read from
  relight::Exhibit exhibit;
  relight::Plan plan;
  ServerSettings server;
  std::vector<std::string> warnings;  ///< about keys of these files that have no effect any more
};

/// A configuration holds cameras itself, as a session.toml does, or names a recorded one: session = "FOLDER" (and then
/// `--set` reaches the keys of that session.toml too). Optional beside either: exhibit = "FILE", [plan], [server].
/// Throws InputError.
ServiceInput read_service(const ServiceFiles& files, const relight::Plan& default_plan);

/// The text of `--set help`.
std::string settable_keys();

/// For replay: what is nearest the truth. For serve: what two cores manage.
relight::Plan replay_plan();
relight::Plan interactive_plan();

}  // namespace lumigraft::server
