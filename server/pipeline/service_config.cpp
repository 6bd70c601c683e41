#include "server/pipeline/service_config.h"

#include <algorithm>

#include "capture/error.h"
#include "server/pipeline/listener_config.h"
#include "server/pipeline/saved_exhibit.h"

namespace lumigraft::server {
namespace {

/// Holds 1500 bricks and as many working copies, what a camera sees of a table. More than any room needs.
constexpr double kMinFieldMemory_mb = 64, kMaxFieldMemory_mb = 1 << 20;

/// Whether `override` sets a key of the configuration itself, not of the session that it names.
bool of_configuration(const std::string& override_line) {
  const std::string head = override_line.substr(0, override_line.find_first_of(".="));
  return head == "server" || head == "plan" || head == "session" || head == "exhibit";
}

/// Where the stream is published and watched. Errors never show a password.
void read_media_server(const capture::ConfigTable& table, ServerSettings& settings) {
  if (table.has("publish")) {
    const std::string url = table.text("publish");
    settings.publish = read_publish_url(url);
    if (!settings.publish) {
      table.fail("publish", "found \"" + shown_of_refused(url) + "\", allowed: " + kPublishAllowed);
    }
  }
  if (table.has("watch")) {
    const std::string url = table.text("watch");
    const std::optional<WatchUrl> watch = read_watch_url(url);
    if (!watch) table.fail("watch", "found \"" + shown_of_refused(url) + "\", allowed: " + kWatchAllowed);
    settings.watch = *watch;
  }
}

ServerSettings read_server(const capture::ConfigTable& root) {
  ServerSettings settings;
  if (const auto table = root.optional_table("server")) {
    settings.max_viewers = table->integer("max_viewers", 1, 10000, settings.max_viewers);
    settings.listeners = read_listeners(*table, settings.max_viewers);
    settings.jpeg_quality = table->integer("jpeg_quality", 1, 100, settings.jpeg_quality);
    RateLimits& rate = settings.rate;
    rate.max_kbit_s = table->integer("max_rate_kbit_s", 100, 1'000'000, rate.max_kbit_s);
    rate.min_kbit_s =
        table->integer("min_rate_kbit_s", 100, rate.max_kbit_s, std::min(rate.min_kbit_s, rate.max_kbit_s));
    if (table->has("recordings")) settings.recordings = table->folder() / table->text("recordings");
    RecordingLimits& limits = settings.recording_limits;
    limits.max_s = table->number("max_recording_s", 1, 86400, limits.max_s);
    limits.max_total_gb = table->number("max_recordings_gb", 0.1, 1e6, limits.max_total_gb);
    limits.min_free_gb = table->number("min_free_disk_gb", 0.1, 1e6, limits.min_free_gb);
    settings.max_upload_mb = table->number("max_upload_mb", 1, 4096, settings.max_upload_mb);
    read_media_server(*table, settings);
    settings.backend = *relight::gpu::backend_named(table->choice("backend", {"best", "vulkan", "egl"}, "best"));
    double& memory_mb = settings.fusion.max_memory_mb;
    if (table->has("room")) settings.room = table->folder() / table->text("room");
    memory_mb = table->number("max_field_memory_mb", kMinFieldMemory_mb, kMaxFieldMemory_mb, memory_mb);
  } else {
    settings.listeners = {listener_at(kDefaultListen, "server.listen")};
  }
  return settings;
}

ExhibitLimits read_limits(const capture::ConfigTable& exhibit) {
  ExhibitLimits limits;
  if (exhibit.has("bounds_m")) {
    const std::vector<double> b = exhibit.numbers("bounds_m", 6);
    limits.bounds_m = Eigen::AlignedBox3d(Eigen::Vector3d(b[0], b[1], b[2]), Eigen::Vector3d(b[3], b[4], b[5]));
    if (limits.bounds_m->isEmpty())
      exhibit.fail("bounds_m",
                   "found a least coordinate above the largest, allowed: x, y, z of the one, then of the other");
  }
  if (exhibit.has("reset_after_s")) limits.reset_after_s = exhibit.number("reset_after_s", 1, 86400);
  return limits;
}

/// Checks that all keys were read, and takes over the warnings about former and obsolete keys.
void finish(const capture::ConfigTable& root, ServiceInput& input) {
  root.finish();
  input.warnings.insert(input.warnings.end(), root.warnings().begin(), root.warnings().end());
}

void read_exhibit_of(const capture::ConfigTable& root, std::uintmax_t max_model_bytes, ServiceInput& input) {
  input.unloaded.clear();
  input.exhibit = relight::read_exhibit(root, max_model_bytes, &input.unloaded);
  input.limits = read_limits(root);
  for (relight::VirtualObject& object : input.exhibit.objects)
    object.white_radiance = static_cast<float>(1 / input.session.color.exposure);
  finish(root, input);
}

/// False where that cannot be used: it may say what an exhibit that was changed later does not allow.
bool read_saved(const std::filesystem::path& exhibit, const std::filesystem::path& saved,
                std::uintmax_t max_model_bytes, ServiceInput& input) {
  try {
    std::vector<std::string> warnings{saved.string() + " is shown in place of what the exhibit says"};
    const std::string text = exhibit_text_with_saved(exhibit, saved, warnings);
    read_exhibit_of(capture::ConfigTable::parse(text, exhibit.string()), max_model_bytes, input);
    input.warnings.insert(input.warnings.end(), warnings.begin(), warnings.end());
    return true;
  } catch (const capture::InputError& e) {
    input.warnings.push_back(saved.string() + " is not used: " + e.what());
    return false;
  }
}

}  // namespace

ServiceInput read_service(const ServiceFiles& files, const relight::Plan& default_plan,
                          std::uintmax_t max_model_bytes) {
  ServiceInput input;
  std::filesystem::path exhibit_file = files.exhibit;
  const auto read_own_keys = [&](const capture::ConfigTable& root) {
    input.plan = relight::read_plan(root, default_plan);
    input.server = read_server(root);
    if (root.has("exhibit")) {
      const std::filesystem::path named = root.existing_file("exhibit");
      exhibit_file = exhibit_file.empty() ? named : exhibit_file;
    }
  };
  const auto read_cameras = [&](const std::filesystem::path& file, const std::vector<std::string>& overrides,
                                bool with_own_keys) {
    const capture::ConfigTable root = capture::ConfigTable::load(file, overrides);
    input.session = capture::read_session(root);
    input.session_text = {file, overrides};
    if (with_own_keys) read_own_keys(root);
    finish(root, input);
  };

  if (files.config.empty()) {
    capture::refuse_if(!std::filesystem::is_directory(files.session),
                       files.session.string() + ": no such folder; a session is a folder with a session.toml");
    read_cameras(files.session / "session.toml", files.overrides, true);
  } else if (!capture::ConfigTable::load(files.config, files.overrides).has("session")) {
    read_cameras(files.config, files.overrides, true);
  } else {
    std::vector<std::string> own, of_session;
    for (const std::string& line : files.overrides) (of_configuration(line) ? own : of_session).push_back(line);
    const capture::ConfigTable root = capture::ConfigTable::load(files.config, own);
    const std::filesystem::path folder = root.folder() / root.text("session");
    if (!std::filesystem::exists(folder / "session.toml")) {
      root.fail("session", "found \"" + root.text("session") + "\", allowed: a folder with a session.toml");
    }
    root.text("name", "");
    root.text("about", "");
    read_own_keys(root);
    finish(root, input);
    read_cameras(folder / "session.toml", of_session, false);
  }

  if (exhibit_file.empty() && std::filesystem::exists(input.session.folder / "exhibit.toml")) {
    exhibit_file = input.session.folder / "exhibit.toml";
  }
  if (!exhibit_file.empty()) {
    const std::filesystem::path saved = saved_exhibit_file(exhibit_file);
    if (!files.with_saved || !std::filesystem::exists(saved) ||
        !read_saved(exhibit_file, saved, max_model_bytes, input))
      read_exhibit_of(capture::ConfigTable::load(exhibit_file), max_model_bytes, input);
    input.limits.saved_file = saved;
    input.exhibit_file = exhibit_file;
  }
  return input;
}

std::string settable_keys() {
  std::string text =
      "Any key of session.toml or of the configuration, by its dotted name: fisheye.source, tag.id ...\n\n";
  for (const relight::PlanKey& key : relight::plan_keys()) {
    text += "  " + key.key + "  (" + key.allowed + ")\n      " + key.meaning + "\n";
  }
  text +=
      "  server.listen  (ADDRESS:PORT or unix:PATH)\n      where serve listens; 127.0.0.1:8080. Who reaches it from "
      "other machines may only look;\n"
      "      [[server.listener]] in the configuration says more\n"
      "  server.max_viewers  (1 to 10000)\n      streams at the same time; 64\n"
      "  server.jpeg_quality  (1 to 100)\n      of JPEG streams and snapshots; 85\n"
      "  server.min_rate_kbit_s  (100 to max_rate_kbit_s)\n      of H.264 while a viewer's network is slow; whose "
      "network carries less gets pictures of half the size; 1000\n"
      "  server.max_rate_kbit_s  (100 to 1000000)\n      of H.264 while any viewer's network has shown a limit; 20000\n"
      "  server.recordings  (DIR)\n      where the page's record button writes sessions of live cameras; none: no "
      "button\n"
      "  server.max_recording_s  (1 to 86400)\n      a recording ends after so long; 600\n"
      "  server.max_recordings_gb  (0.1 to 1000000)\n      of all recordings together; the oldest are removed; 50\n"
      "  server.min_free_disk_gb  (0.1 to 1000000)\n      of the disk of recordings and uploaded models, left to "
      "others; 5\n"
      "  server.max_upload_mb  (1 to 4096)\n      of a model that is uploaded on the page; 256\n"
      "  server.publish  (rtsp://HOST/PATH, srt://HOST:PORT?streamid=... or rtp://HOST:PORT)\n      a media server "
      "that "
      "the stream is published to; none\n"
      "  server.watch  (URL)\n      where the page /watch.html gets it from that server, by WHEP; none\n"
      "  server.backend  (best, vulkan, egl)\n      what draws; best: a hardware GPU before software, Vulkan before "
      "EGL\n"
      "  server.max_field_memory_mb  (64 to 1048576)\n      memory of the reconstructed room; where it is short, what "
      "is "
      "out of view for long and far from the tag is\n      forgotten; 768\n"
      "  server.room  (FILE)\n      the reconstructed room, kept for the next start; of live cameras KIOSK.room beside "
      "KIOSK.toml\n";
  return text;
}

relight::Plan replay_plan() {
  relight::Plan plan;
  plan.method = "rays";
  return plan;
}

relight::Plan interactive_plan() {
  relight::Plan plan;
  plan.volume = 64;
  plan.trace_scale = 4;
  plan.rsm = 128;
  plan.look = "camera";
  plan.budget_ms = 33;  // a picture of a camera of 30 Hz
  return plan;
}

}  // namespace lumigraft::server
