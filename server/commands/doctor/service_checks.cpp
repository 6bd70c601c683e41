#include "server/commands/doctor/service_checks.h"

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <system_error>

#include "capture/error.h"
#include "capture/message_text.h"
#include "capture/recorded/seekable_reader.h"
#include "capture/session/source_uri.h"
#include "server/commands/doctor/permissions.h"
#include "server/commands/recordings_folder.h"
#include "server/pipeline/listener_config.h"
#include "server/stream/web_server.h"

namespace lumigraft::server {
namespace {

namespace fs = std::filesystem;

constexpr double kMin_free_gb = 0.2;  // of a room with its tag map and views, and of compiled shaders

std::string mend_listener(const ListenerSettings& listener, const std::string& error) {
  const auto says = [&](int number) { return error.ends_with(std::strerror(number)); };
  if (!listener.socket.empty()) {
    if (error.ends_with("another program does")) return "sudo systemctl stop lumigraft, or another path";
    return mend_folder(listener.socket.parent_path());
  }
  const std::string port = std::to_string(listener.port);
  if (says(EADDRINUSE))
    return "`sudo ss -ltnp 'sport = :" + port +
           "'` names the program that uses it (a running service is one); end it, " + "or choose another port";
  if (says(EACCES)) return "a port of 1024 or more, or AmbientCapabilities=CAP_NET_BIND_SERVICE in the unit";
  if (says(EADDRNOTAVAIL)) return "an address that `ip -brief address` lists, or 0.0.0.0";
  return listener.encrypted() ? "PEM files that belong together in the keys certificate and key" : "";
}

void check_folder(DoctorReport& report, const std::string& what, const fs::path& folder, double min_free_gb) {
  if (const std::string reason = unwritable(folder); !reason.empty())
    return report.missing(what, reason, mend_folder(folder));
  const double free_gb = static_cast<double>(RecordingsFolder::disk_free_bytes(existing_part(folder))) / 1e9;
  const std::string text = folder.string() + capture::formatted(", %.1f GB free", free_gb);
  if (free_gb >= min_free_gb) return report.ok(what, text);
  report.missing(what, text + capture::formatted(", less than %.1f GB", min_free_gb),
                 "delete files of this disk (`sudo du -xh --max-depth=2 / | sort -h`), or a folder on another");
}

/// Where Mesa keeps compiled shaders.
fs::path shader_cache() {
  for (const char* name : {"MESA_SHADER_CACHE_DIR", "XDG_CACHE_HOME"})
    if (const char* const folder = std::getenv(name); folder && *folder) return folder;
  const char* const home = std::getenv("HOME");
  return home ? fs::path(home) / ".cache" : fs::path();
}

}  // namespace

std::optional<ServiceInput> check_configuration(DoctorReport& report, const ServiceFiles& files) {
  const std::string what = "configuration " + files.config.string();
  try {
    ServiceInput input = read_service(files, interactive_plan());
    capture::refuse_if(input.plan.method == "reference",
                       "plan.method: found \"reference\", allowed with serve: what draws while it runs, as \"dvct\"");
    const auto color = capture::parse_source(input.session.color.source);
    if (color && !color->live) capture::seekable_frames(capture::open_sources(input.session));
    report.ok(what, std::to_string(input.exhibit.objects.size()) + " objects, all models are loaded");
    for (const std::string& warning : input.warnings) report.note(what, warning, "");
    return input;
  } catch (const std::exception& e) {
    report.missing(what, capture::on_one_line(e.what()), "docs/configuration.md describes every key");
    return std::nullopt;
  }
}

void check_listeners(DoctorReport& report, const std::vector<ListenerSettings>& listeners) {
  for (const ListenerSettings& listener : listeners) {
    const std::string what = "listener " + listener.url(listener.port);
    try {
      EncoderDemand demand;
      Metrics metrics;
      WebSettings settings;
      settings.listeners = {listener};
      const WebServer bound(settings, {}, demand, metrics);
      report.ok(what, "free; permits " + capture::listed(listener.permissions.names()));
      if (!listener.socket.empty()) fs::remove(listener.socket);
    } catch (const std::exception& e) {
      report.missing(what, e.what(), mend_listener(listener, e.what()));
    }
  }
  for (const std::string& warning : listener_warnings(listeners))
    report.note("listener", warning,
                warning.find("certificate ") != std::string::npos
                    ? "a new certificate in the same file, then sudo systemctl reload lumigraft"
                    : "");
}

void check_folders(DoctorReport& report, const ServiceInput& input) {
  const auto color = capture::parse_source(input.session.color.source);
  const bool live = color && color->live;
  const fs::path folder = fs::absolute(input.session_text.file).parent_path();
  const fs::path& room = input.server.room;
  if (live) check_folder(report, "folder of the tag map, views and room", folder, kMin_free_gb);
  if (!room.empty()) check_folder(report, "folder of the room", fs::absolute(room).parent_path(), kMin_free_gb);
  if (live && !input.server.recordings.empty())
    check_folder(report, "folder of recordings", input.server.recordings, input.server.recording_limits.min_free_gb);
  const fs::path cache = shader_cache();
  const std::string reason = cache.empty() ? "this user has no HOME" : unwritable(cache);
  if (reason.empty()) return check_folder(report, "folder of compiled shaders", cache, kMin_free_gb);
  report.note("folder of compiled shaders", reason + ": every start compiles them, for up to minutes",
              "CacheDirectory=lumigraft and Environment=XDG_CACHE_HOME=/var/cache/lumigraft in the unit, or " +
                  mend_folder(cache.empty() ? fs::path("/var/cache/lumigraft") : cache));
}

}  // namespace lumigraft::server
