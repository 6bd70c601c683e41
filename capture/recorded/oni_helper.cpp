// lumigraft_oni: the program that recordings of OpenNI2 are read in, started by OniSource.
//
//   lumigraft_oni FILE [color|depth WIDTH HEIGHT UNIT_M] ...
//
// It writes to descriptor 3 (oni_messages.h), takes little more memory than a recording needs, and ends itself where
// OpenNI2 hangs.
#include <sys/resource.h>
#include <unistd.h>

#include <array>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>

#include "capture/error.h"
#include "capture/live/openni/source.h"
#include "capture/recorded/oni_messages.h"

namespace lumigraft::capture {
namespace {

/// More memory than this process has by now that a recording may make it take.
void allow_memory(std::uint64_t more_bytes) {
  std::uint64_t pages = 0;
  if (std::ifstream("/proc/self/statm") >> pages) {
    const rlim_t most = pages * static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE)) + more_bytes;
    const rlimit limit{most, most};
    setrlimit(RLIMIT_AS, &limit);
  }
}

void tell(const void* data, std::size_t size) {
  const auto* bytes = static_cast<const std::uint8_t*>(data);
  while (size > 0) {
    const ssize_t written = write(kOniPipe, bytes, size);
    if (written <= 0) {
      _exit(0);  // nobody listens any more
    }
    bytes += written;
    size -= static_cast<std::size_t>(written);
  }
}

void tell(const OniMessage& message) { tell(&message, sizeof message); }

void set_text(OniMessage& message, const std::string& text) {
  std::snprintf(message.text.data(), message.text.size(), "%s", text.c_str());
}

void tell(const SourceItem& item, const std::vector<StreamSpec>& specs) {
  OniMessage message;
  while (specs[message.stream].stream != stream_of(item)) {
    ++message.stream;
  }
  message.time_ns = stamp_of(item).time_ns;
  message.sequence = stamp_of(item).sequence;
  if (const auto* lost = std::get_if<LostPicture>(&item)) {
    message.kind = OniMessage::Kind::lost;
    set_text(message, lost->reason);
    tell(message);
    return;
  }
  message.kind = OniMessage::Kind::picture;
  tell(message);
  if (const auto* depth = std::get_if<RawDepth>(&item)) {
    tell(depth->counts.data.data(), 2 * depth->counts.data.size());
  } else {
    const auto& rgb = std::get<Picture>(item).encoded.data;
    tell(rgb.data(), rgb.size());
  }
}

void play(const std::string& file, const std::vector<StreamSpec>& specs) {
  constexpr unsigned kLongestPause_s = 10;  // then SIGALRM ends it
  std::signal(SIGALRM, SIG_DFL);
  alarm(kLongestPause_s);
  OpenNiSource source(OpenNiSource::Kind::recording, file, specs);
  alarm(0);
  OniMessage opened;
  opened.kind = OniMessage::Kind::opened;
  tell(opened);
  while (!source.finished()) {
    alarm(kLongestPause_s);
    const std::optional<SourceItem> item = source.next(std::chrono::milliseconds(0));
    alarm(0);  // whoever reads the pipe may take their time
    if (item) {
      tell(*item, specs);
    }
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
  setrlimit(RLIMIT_CORE, &no_core);  // of a crash that is expected
  std::signal(SIGPIPE, SIG_IGN);
  constexpr std::uint64_t kMostOfAFile = std::uint64_t{1} << 30;
  allow_memory(kMostOfAFile);
  if (std::freopen("/dev/null", "w", stdout) == nullptr || std::freopen("/dev/null", "w", stderr) == nullptr) {
    return 1;
  }
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
    tell(refused);
  }
  _exit(0);  // the library's own end may crash too
}
