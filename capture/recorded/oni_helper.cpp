// lumigraft_oni: helper program that reads OpenNI2 recordings, started by OniSource.
//
//   lumigraft_oni FILE [color|depth WIDTH HEIGHT UNIT_M] ...
//
// It writes to descriptor 3 (oni_messages.h), limits its own memory, and ends itself if OpenNI2 hangs.
#include <sys/resource.h>
#include <unistd.h>

#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>

#include "capture/error.h"
#include "capture/live/openni/source.h"
#include "capture/recorded/oni_messages.h"
#include "capture/recorded/parameters.h"

namespace lumigraft::capture {
namespace {

/// Limits this process to `more_bytes` of memory above its present size, against damaged recordings.
void limit_memory(std::uint64_t more_bytes) {
  std::uint64_t pages = 0;
  if (std::ifstream("/proc/self/statm") >> pages) {
    const rlim_t max_bytes = pages * static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE)) + more_bytes;
    const rlimit limit{max_bytes, max_bytes};
    setrlimit(RLIMIT_AS, &limit);
  }
}

void send(const void* data, std::size_t size) {
  const auto* bytes = static_cast<const std::uint8_t*>(data);
  while (size > 0) {
    const ssize_t written = write(kOniPipe, bytes, size);
    if (written <= 0) _exit(0);  // the reader has gone
    bytes += written;
    size -= static_cast<std::size_t>(written);
  }
}

void send(const OniMessage& message) { send(&message, sizeof message); }

void set_text(OniMessage& message, const std::string& text) {
  std::snprintf(message.text.data(), message.text.size(), "%s", text.c_str());
}

void send(const SourceItem& item, const std::vector<StreamSpec>& specs) {
  OniMessage message;
  while (specs[message.stream].stream != stream_of(item)) ++message.stream;
  message.time_ns = stamp_of(item).time_ns;
  message.sequence = stamp_of(item).sequence;
  if (const auto* lost = std::get_if<LostFrame>(&item)) {
    message.kind = OniMessage::Kind::lost;
    set_text(message, lost->reason);
    send(message);
    return;
  }
  message.kind = OniMessage::Kind::frame;
  send(message);
  if (const auto* depth = std::get_if<RawDepth>(&item)) {
    send(depth->counts.data.data(), 2 * depth->counts.data.size());
  } else {
    const auto& rgb = std::get<Frame>(item).encoded.data;
    send(rgb.data(), rgb.size());
  }
}

void play(const std::string& file, const std::vector<StreamSpec>& specs) {
  constexpr unsigned kMaxPause_s = kRecordedParameters.oni_pause_s;  // then SIGALRM ends the process
  std::signal(SIGALRM, SIG_DFL);
  alarm(kMaxPause_s);
  OpenNiSource source(OpenNiSource::Kind::recording, file, specs);
  alarm(0);
  send(OniMessage{.kind = OniMessage::Kind::opened});
  while (!source.finished()) {
    alarm(kMaxPause_s);
    const std::optional<SourceItem> item = source.next(std::chrono::milliseconds(0));
    alarm(0);  // the reader of the pipe may be slow
    if (item) send(*item, specs);
  }
}

}  // namespace
}  // namespace lumigraft::capture

int main(int count, char** words) {
  using namespace lumigraft::capture;
  if (count < 6 || count % 4 != 2) {
    std::fputs("lumigraft_oni: started by lumigraft where a source is oni:\n", stderr);
    return 2;
  }
  const rlimit no_core{0, 0};
  setrlimit(RLIMIT_CORE, &no_core);  // crashes are expected
  std::signal(SIGPIPE, SIG_IGN);
  limit_memory(kRecordedParameters.oni_memory_bytes);
  if (std::freopen("/dev/null", "w", stdout) == nullptr || std::freopen("/dev/null", "w", stderr) == nullptr) return 1;
  std::vector<StreamSpec> specs;
  for (int i = 2; i + 3 < count; i += 4) {
    specs.push_back({.stream = std::strcmp(words[i], "depth") == 0 ? Stream::depth : Stream::color,
                     .width = std::atoi(words[i + 1]),
                     .height = std::atoi(words[i + 2]),
                     .unit_m = std::atof(words[i + 3])});
  }
  try {
    play(words[1], specs);
  } catch (const InputError& e) {
    OniMessage refused;
    set_text(refused, e.what());
    send(refused);
  }
  _exit(0);  // the library's destructors may crash too
}
