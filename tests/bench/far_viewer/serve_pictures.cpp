// Sends the colour frames of a recording, back and forth, at a fixed rate through the service's encoders and web
// server, so that what viewers see depends on the network and not on how fast this machine renders. Ends after SECONDS.
//
//   build/release/serve_pictures SESSION ADDRESS:PORT HZ SECONDS
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <memory>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "capture/session/session.h"
#include "capture/source.h"
#include "server/stream/encode_stage.h"
#include "server/stream/page.h"
#include "server/stream/web_server.h"

namespace lumigraft::test {
namespace {

using Picture = std::shared_ptr<const capture::Image<std::uint8_t>>;
using Clock = std::chrono::steady_clock;

std::vector<Picture> pictures_of(const std::filesystem::path& folder) {
  const capture::Session session = capture::read_session(capture::ConfigTable::load(folder / "session.toml"));
  const auto reader = capture::open_frames(session);
  std::vector<Picture> pictures;
  while (auto frame = reader->next(std::chrono::seconds(1)))
    pictures.emplace_back(frame->color, &frame->color->encoded);
  for (std::size_t i = pictures.size(); i-- > 1;) pictures.push_back(pictures[i - 1]);
  return pictures;
}

void serve(const std::vector<Picture>& pictures, const std::string& address, double rate_hz, double seconds) {
  server::EncoderDemand demand;
  server::Metrics metrics;
  server::WebHandlers handlers;
  handlers.get = [](std::string_view path) { return server::page_reply(path); };
  handlers.hello = [](server::Permissions) {
    return std::string(
        R"({"type":"hello","protocol":1,"program":"","session":"","objects":[],"permissions":["view"]})");
  };
  server::WebSettings settings;
  const std::size_t colon = address.find(':');
  settings.listeners[0].address = address.substr(0, colon);
  settings.listeners[0].port = static_cast<std::uint16_t>(std::atoi(address.c_str() + colon + 1));
  server::WebServer web(settings, std::move(handlers), demand, metrics);
  server::EncodeStage encode(85, demand, metrics);
  web.start();
  const Clock::time_point begin = Clock::now();
  double text_s = 0;
  for (std::uint32_t i = 0; i < seconds * rate_hz; ++i) {
    std::this_thread::sleep_until(
        begin + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(i / rate_hz)));
    for (auto& message : encode.encode({pictures[i % pictures.size()], i, false, Clock::now()}))
      web.publish(std::move(message));
    if (i / rate_hz >= text_s) {
      web.publish_text("stats", R"({"type":"stats","fps":0,"frames":0,"clients":0,"stage_ms":{}})");
      text_s += 1;
    }
  }
  web.stop();
}

}  // namespace
}  // namespace lumigraft::test

int main(int count, char** words) try {
  if (count != 5) {
    std::fprintf(stderr, "usage: serve_pictures SESSION ADDRESS:PORT HZ SECONDS\n");
    return 2;
  }
  const auto pictures = lumigraft::test::pictures_of(words[1]);
  if (pictures.empty()) throw std::runtime_error(std::string(words[1]) + ": found no picture");
  lumigraft::test::serve(pictures, words[2], std::atof(words[3]), std::atof(words[4]));
  return 0;
} catch (const std::exception& e) {
  std::fprintf(stderr, "%s\n", e.what());
  return 1;
}
