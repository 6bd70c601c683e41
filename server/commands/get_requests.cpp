#include "server/commands/get_requests.h"

#include <optional>
#include <utility>
#include <vector>

#include "server/commands/parameters.h"
#include "server/commands/serve_texts.h"
#include "server/stream/page.h"

namespace lumigraft::server {
namespace {

/// Who loads it opens the stream a fraction of a second later.
constexpr std::string_view kScriptOfPage = "/main.js";

}  // namespace

WebReply GetRequests::answer(std::string_view path) {
  if (path == "/healthz") {
    const Health h = health(metrics_);
    return {.status = h.ok ? 200u : 503u, .type = "application/json", .body = h.json};
  }
  if (path == "/metrics")
    return {.status = 200, .type = "text/plain; version=0.0.4; charset=utf-8", .body = metrics_.prometheus()};
  if (path == "/watch.html" || path == "/watch.json") return watch(path);
  if (path.starts_with("/maps/")) return map(path);
  if (path == kScriptOfPage) pipeline_.picture_asked();  // a browser, unlike a monitor that asks for the page alone
  return page_reply(path);
}

/// The newest picture, encoded at most five times a second however often it is asked for.
WebReply GetRequests::snapshot() {
  const auto now = std::chrono::steady_clock::now();
  if (snapshot_.empty() || now - encoded_ >= kCommands.snapshots_apart) {
    pipeline_.picture_asked();
    const ShownFrame newest = pipeline_.newest();
    if (!newest.srgb) return {.status = 503, .body = "no picture yet\n"};
    const std::vector<std::uint8_t> file = encoder_.encode(*newest.srgb);
    snapshot_.assign(file.begin(), file.end());
    encoded_ = now;
  }
  return {.status = 200, .type = "image/jpeg", .body = snapshot_};
}

/// Of a path as /maps/depth.jpg.
WebReply GetRequests::map(std::string_view path) {
  constexpr std::string_view kBefore = "/maps/", kAfter = ".jpg";
  const std::string_view name = path.substr(kBefore.size());
  const auto kind = map_named(name.ends_with(kAfter) ? name.substr(0, name.size() - kAfter.size()) : "");
  if (!kind) {
    std::string names;
    for (const MapKind one : kAllMaps) names += " " + std::string(name_of(one)) + ".jpg";
    return {.status = 404, .body = "no such map, allowed:" + names + "\n"};
  }
  std::optional<MapPicture> map = pipeline_.map(*kind);
  if (!map) return {.status = 503, .body = "not drawn yet, or what it shows is not known: ask again\n"};
  return {.status = 200,
          .type = "image/jpeg",
          .body = std::move(map->jpeg),
          .headers = {{"X-Sequence", std::to_string(map->sequence)}}};
}

/// The page that plays what is published, and where it gets that from.
WebReply GetRequests::watch(std::string_view path) const {
  if (path == "/watch.json") return {.type = "application/json", .body = watch_text(watch_.url)};
  WebReply page = page_reply(path);
  page.connects_to = watch_.origin;
  return page;
}

}  // namespace lumigraft::server
