#include "capture/live/helper_output.h"

#include <unistd.h>

#include <csignal>
#include <cstdio>
#include <cstdlib>

#include "capture/error.h"

namespace lumigraft::capture {
namespace {

void send(const void* data, std::size_t size) {
  const auto* bytes = static_cast<const std::uint8_t*>(data);
  while (size > 0) {
    const ssize_t written = write(kHelperPipe, bytes, size);
    if (written <= 0) _exit(0);
    bytes += written;
    size -= static_cast<std::size_t>(written);
  }
}

void send(HelperMessage message, const void* data, std::size_t size) {
  message.bytes = static_cast<std::uint32_t>(size);
  send(&message, sizeof message);
  send(data, size);
}

}  // namespace

std::vector<StreamSpec> requested_streams(int count, char** words, int first) {
  std::vector<StreamSpec> specs;
  for (int i = first; i + 3 < count; i += 4) {
    const std::string name = words[i];
    specs.push_back({.stream = name.ends_with("depth") ? Stream::depth : Stream::color,
                     .width = std::atoi(words[i + 1]),
                     .height = std::atoi(words[i + 2]),
                     .unit_m = std::atof(words[i + 3]),
                     .registered = name != "depth"});
  }
  return specs;
}

void run_helper(int count, char** words, const RunHelper& run) {
  const bool named = count % 4 == 2;
  if (count < 5 || (!named && count % 4 != 1)) {
    std::fprintf(stderr, "%s: started by lumigraft where a source names it or its kind of camera\n", words[0]);
    _exit(2);
  }
  std::signal(SIGPIPE, SIG_IGN);
  try {
    run(named ? words[1] : "", requested_streams(count, words, named ? 2 : 1));
  } catch (const CameraFault& e) {
    send_text(HelperMessage::Kind::unavailable, e.what());
  } catch (const InputError& e) {
    send_text(HelperMessage::Kind::refused, e.what());
  } catch (const std::exception& e) {
    send_text(HelperMessage::Kind::unavailable, e.what());
  }
  _exit(0);
}

void send_text(HelperMessage::Kind kind, const std::string& text) { send({.kind = kind}, text.data(), text.size()); }

void send_item(const SourceItem& item, const std::vector<StreamSpec>& specs) {
  HelperMessage message{.kind = HelperMessage::Kind::frame};
  while (specs[message.stream].stream != stream_of(item)) ++message.stream;
  message.time_ns = stamp_of(item).time_ns;
  message.sequence = stamp_of(item).sequence;
  if (const auto* lost = std::get_if<LostFrame>(&item)) {
    message.kind = HelperMessage::Kind::lost;
    send(message, lost->reason.data(), lost->reason.size());
  } else if (const auto* depth = std::get_if<RawDepth>(&item)) {
    send(message, depth->counts.data.data(), 2 * depth->counts.data.size());
  } else {
    const auto& rgb = std::get<Frame>(item).encoded.data;
    send(message, rgb.data(), rgb.size());
  }
}

}  // namespace lumigraft::capture
