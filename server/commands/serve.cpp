#include "server/commands/serve.h"

#include <chrono>
#include <cstdio>
#include <future>
#include <mutex>
#include <utility>

#include "capture/error.h"
#include "capture/message_text.h"
#include "capture/record/source_observer.h"
#include "capture/recorded/seekable_reader.h"
#include "relight/gpu/hang.h"
#include "server/commands/get_requests.h"
#include "server/commands/gpu_probe.h"
#include "server/commands/kept_room_file.h"
#include "server/commands/model_upload.h"
#include "server/commands/parameters.h"
#include "server/commands/record_button.h"
#include "server/commands/serve_log.h"
#include "server/commands/serve_texts.h"
#include "server/commands/service_manager.h"
#include "server/commands/stop_signal.h"
#include "server/commands/tag_map_file.h"
#include "server/commands/views_file.h"
#include "server/pipeline/listener_config.h"
#include "server/pipeline/parameters.h"
#include "server/pipeline/pipeline.h"
#include "server/publish/publisher.h"
#include "server/stream/web_server.h"

namespace lumigraft::server {
namespace {

static_assert(relight::gpu::kHardware_hangs_after < kCommands.hung_after, "a new device is tried before a restart");

/// Name of what hangs, as a thread; empty while nothing does.
std::string hung_in(const Pipeline& pipeline, WebServer& web) {
  if (const auto thread = pipeline.hung(kCommands.hung_after)) return *thread;
  return std::chrono::steady_clock::now() - web.last_turn() > kCommands.hung_after ? "network" : "";
}

}  // namespace

void run_serve(const ServiceFiles& as_asked, const std::string& listen) {
  static StopSignal stop(true);  // its thread runs until the process ends
  ServiceFiles files = as_asked;
  files.with_saved = true;
  ServiceInput input = read_service(files, interactive_plan(), kPipeline.max_model_bytes);
  for (const std::string& warning : input.warnings) std::fprintf(stderr, "lumigraft: %s\n", warning.c_str());
  if (!listen.empty()) input.server.listeners = {listener_at(listen, "--listen")};
  for (const std::string& warning : listener_warnings(input.server.listeners))
    std::fprintf(stderr, "lumigraft: %s\n", warning.c_str());
  capture::refuse_if(input.plan.method == "reference",
                     "plan.method: found \"reference\", allowed with serve: what draws while it runs, as \"dvct\"");
  const capture::Session session = input.session;
  const ServerSettings server = input.server;
  const bool no_gpu = LiveRelighter::rays_may_draw(input.plan) && only_software_device(server.backend);
  const std::filesystem::path exhibit_file = input.exhibit_file;
  capture::SourceObserver tap;
  capture::Session named = session;  // as the cameras call themselves
  const auto open = [&tap, &named, session]() -> Pipeline::Cameras {
    capture::PairedSources sources = capture::open_sources(session);
    if (!sources.live) return {capture::seekable_frames(std::move(sources)), nullptr};
    capture::take_serials(named, sources);
    sources = tap.on(sources);
    std::unique_ptr<capture::FisheyeReader> fisheye = capture::read_fisheye_apart(sources);
    return {std::make_unique<capture::PairingReader>(std::move(sources)), std::move(fisheye)};
  };
  Pipeline::Cameras cameras = open();
  const bool live = cameras.frames->live();
  std::optional<RecordButton> button;
  if (live && !server.recordings.empty())
    button.emplace(input.session_text, named, RecordingsFolder(server.recordings, server.recording_limits),
                   server.recording_limits.max_s, tap);

  std::optional<TagMapFile> tag_map;
  if (!session.tag.extra.empty() && (live || !session.tag.map.empty())) {
    tag_map.emplace(session.tag.map.empty() ? default_tag_map(input.session_text.file) : session.tag.map, session.tag);
    if (!tag_map->message().empty()) std::fprintf(stderr, "lumigraft: %s\n", tag_map->message().c_str());
    input.tag_map = tag_map->learnt();
  }
  std::optional<ViewsFile> views;
  if (live) {
    views.emplace(views_file_of(input.session_text.file), session);
    if (!views->message().empty()) std::fprintf(stderr, "lumigraft: %s\n", views->message().c_str());
    input.views = views->views();
  }
  std::optional<KeptRoomFile> room;
  if (live || !server.room.empty()) {
    room.emplace(server.room.empty() ? default_kept_room(input.session_text.file) : server.room, session.tag,
                 server.fusion);
    if (!room->message().empty()) std::fprintf(stderr, "lumigraft: %s\n", room->message().c_str());
    input.room = room->take();
  }
  Pipeline::Keep keep;
  if (room) {
    keep = [&room](const reconstruct::RoomToKeep& found) {
      const std::string failure = room->save(found);
      if (!failure.empty()) std::fprintf(stderr, "lumigraft: %s\n", failure.c_str());
      return room->size();
    };
  }

  EncoderDemand demand;
  Metrics metrics;
  WebServer* web_pointer = nullptr;
  std::optional<Publisher> publisher;
  if (server.publish) publisher.emplace(*server.publish, demand, metrics);
  Pipeline pipeline(
      std::move(input), std::move(cameras), open,
      [no_gpu, backend = server.backend] {
        return no_gpu ? nullptr : relight::gpu::create_device(backend, relight::gpu::DeviceOptions{});
      },
      demand, metrics,
      [&publisher, &web_pointer](std::shared_ptr<const StreamMessage> message) {
        if (publisher && message->size == StreamSize::full) publisher->offer(message);
        web_pointer->publish(std::move(message));
      },
      std::move(keep));

  GetRequests requests(pipeline, metrics, server.watch, server.jpeg_quality);
  const WebSettings settings{.listeners = server.listeners,
                             .max_viewers = server.max_viewers,
                             .max_connections = 4 * server.max_viewers,
                             .rate = server.rate};
  WebHandlers handlers;
  handlers.get = [&](std::string_view path) { return requests.answer(path); };
  handlers.snapshot = [&] { return requests.snapshot(); };
  handlers.hello = [&](Permissions permissions) { return hello_text(session, pipeline.exhibit(), permissions); };
  handlers.state = [&] { return state_text(pipeline.exhibit()); };
  handlers.change_object = [&](const ObjectCommand& command) { return pipeline.change_object(command); };
  handlers.record = [&](bool on) -> std::optional<std::string> {
    if (!button) {
      return "record: found a service that does not, allowed where its configuration has server.recordings and cameras";
    }
    button->press(on);
    return std::nullopt;
  };
  handlers.playback = [&](const PlaybackCommand& command) -> std::optional<std::string> {
    if (live) return "playback: found live cameras, allowed where a recording plays";
    pipeline.playback().apply(command);
    return std::nullopt;
  };
  handlers.save = [&]() -> std::string {
    try {
      pipeline.exhibit().save();
      return "";
    } catch (const std::exception& e) {
      std::fprintf(stderr, "lumigraft: the exhibit cannot be saved: %s\n", e.what());
      return "the exhibit cannot be saved; the log of the service says why";
    }
  };
  std::mutex reading;  // of the files, again
  const ModelUpload models(exhibit_file, server.max_upload_mb, server.recording_limits.min_free_gb, [&] {
    const std::lock_guard lock(reading);
    ServiceInput again = read_service(files, interactive_plan());
    pipeline.replace_exhibit(std::move(again.exhibit), std::move(again.limits));
  });
  handlers.upload = UploadHandlers{
      .begin = [&](std::string_view name, auto bytes) { return models.begin(name, bytes); },
      .received = [&](const std::filesystem::path& file, std::string_view name) { return models.received(file, name); },
      .remove = [&](std::string_view name) { return models.remove(name); }};
  WebServer web(settings, std::move(handlers), demand, metrics);
  web_pointer = &web;
  stop.arm();
  pipeline.start();
  web.start();
  for (std::size_t i = 0; i < server.listeners.size(); ++i)
    std::fprintf(stderr, "lumigraft: serving %s  (session %s; permits %s)\n",
                 server.listeners[i].url(web.port(i)).c_str(), session.name.c_str(),
                 capture::listed(server.listeners[i].permissions.names()).c_str());

  const auto save_tag_map = [&] {
    const auto learnt = tag_map ? pipeline.take_tag_map() : std::nullopt;
    const std::string failure = learnt ? tag_map->save(*learnt) : "";
    if (!failure.empty()) std::fprintf(stderr, "lumigraft: %s\n", failure.c_str());
  };
  const auto save_views = [&] {
    const auto kept = views ? pipeline.take_views() : std::nullopt;
    const std::string failure = kept ? views->save(*kept) : "";
    if (!failure.empty()) std::fprintf(stderr, "lumigraft: %s\n", failure.c_str());
  };
  // Reads the files again, on a thread of its own: models may take seconds.
  const auto reload = [&] {
    const std::lock_guard lock(reading);
    try {
      ServiceInput again = read_service(files, interactive_plan());
      if (!listen.empty()) again.server.listeners = {listener_at(listen, "--listen")};
      std::vector<std::string> said = web.change_listeners(again.server.listeners);
      pipeline.replace_exhibit(std::move(again.exhibit), std::move(again.limits));
      web.greet();  // permissions
      reconstruct::append_warnings(said, again.warnings);
      reconstruct::append_warnings(said, listener_warnings(again.server.listeners));
      if (again.server.publish != server.publish || again.server.watch != server.watch)
        said.emplace_back("server.publish and server.watch take effect at the next start");
      for (const std::string& line : said) std::fprintf(stderr, "lumigraft: %s\n", line.c_str());
      std::fprintf(stderr, "lumigraft: read the exhibit and the listeners again\n");
    } catch (const std::exception& e) {
      std::fprintf(stderr, "lumigraft: not read again, what runs goes on: %s\n", e.what());
    }
  };
  std::future<void> reloading;
  bool reload_wanted = false;
  std::size_t replaced = 0;
  // Some megabytes; new views are many in the first minute and rare later.
  auto views_saved = std::chrono::steady_clock::now(), certificates_read = views_saved;
  std::size_t models_given = 0;
  ServeLog log;
  ServiceManager manager;
  while (!stop.wait(std::chrono::seconds(1))) {
    const bool reloads = reloading.valid() && reloading.wait_for(std::chrono::seconds(0)) != std::future_status::ready;
    reload_wanted = stop.take_reload() || reload_wanted;
    if (reload_wanted && !reloads) {
      reload_wanted = false;
      reloading = std::async(std::launch::async, reload);
    }
    if (const std::size_t now = pipeline.exhibit().replaced(); now != std::exchange(replaced, now)) web.greet();
    const Pipeline::Record record = pipeline.newest_record();
    std::vector<std::string> warnings = record.warnings;
    if (publisher) {
      if (const auto warning = publisher->warning()) warnings.push_back(*warning);
    }
    log.tick(warnings, metrics.drops());  // before viewers know: whoever reads of it finds it in the log
    web.publish_text("stats",
                     stats_text(record, metrics, metrics.take_interval(),
                                button ? std::optional(button->state()) : std::nullopt, pipeline.playback().state()));
    if (const std::size_t given = pipeline.exhibit().models_given(); given != models_given) {
      models_given = given;
      web.publish_text("state", state_text(pipeline.exhibit()));  // with its animations and variants
    }
    if (pipeline.exhibit().reset_if_idle()) web.publish_text("state", state_text(pipeline.exhibit()));
    if (metrics.frames() > 0) manager.ready();
    manager.tick(hung_in(pipeline, web), std::to_string(metrics.viewers()) + " viewers");
    save_tag_map();
    if (std::chrono::steady_clock::now() - certificates_read >= kCommands.certificates_apart) {
      for (const std::string& warning : certificate_warnings(server.listeners))
        std::fprintf(stderr, "lumigraft: %s\n", warning.c_str());
      certificates_read = std::chrono::steady_clock::now();
    }
    if (std::chrono::steady_clock::now() - views_saved >= std::chrono::minutes(1)) {
      save_views();
      views_saved = std::chrono::steady_clock::now();
    }
  }
  manager.stopping();
  pipeline.stop();  // requests the stages to stop; one may be in a long call
  if (publisher) publisher->stop();
  pipeline.keep_room();
  save_tag_map();
  save_views();
  stop.saved();
  web.stop();
  pipeline.join();  // or the stop signal's grace period ends first
}

}  // namespace lumigraft::server
