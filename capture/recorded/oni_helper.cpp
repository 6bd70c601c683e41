// lumigraft_oni: helper program that reads OpenNI2 recordings, started by OniSource.
//
//   lumigraft_oni FILE STREAM...
//
// It writes what docs/helpers.md describes, limits its own memory, and ends itself if OpenNI2 hangs.
#include <sys/resource.h>
#include <unistd.h>

#include <csignal>
#include <cstdio>
#include <fstream>

#include "capture/error.h"
#include "capture/live/helper_output.h"
#include "capture/live/openni/source.h"
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

void play(const std::string& file, const std::vector<StreamSpec>& specs) {
  constexpr unsigned kMaxPause_s = kRecordedParameters.oni_pause_s;  // then SIGALRM ends the process
  std::signal(SIGALRM, SIG_DFL);
  alarm(kMaxPause_s);
  OpenNiSource source(OpenNiSource::Kind::recording, file, specs);
  alarm(0);
  send_text(HelperMessage::Kind::opened, "");
  while (!source.finished()) {
    alarm(kMaxPause_s);
    const std::optional<SourceItem> item = source.next(std::chrono::milliseconds(0));
    alarm(0);  // the reader of the pipe may be slow
    if (item) send_item(*item, specs);
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
  try {
    play(words[1], requested_streams(count, words, 2));
  } catch (const InputError& e) {
    send_text(HelperMessage::Kind::refused, e.what());
  }
  _exit(0);  // the library's destructors may crash too
}
