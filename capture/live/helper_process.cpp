#include "capture/live/helper_process.h"

#include <poll.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <csignal>
#include <cstring>
#include <filesystem>
#include <thread>

#include "capture/descriptor.h"
#include "capture/error.h"
#include "capture/live/parameters.h"

namespace lumigraft::capture {

HelperProcess::HelperProcess(const char* program, std::vector<std::string> arguments, int descriptor, int number) {
  const std::string file = (std::filesystem::read_symlink("/proc/self/exe").parent_path() / program).string();
  arguments.insert(arguments.begin(), file);
  std::vector<char*> argv;
  for (std::string& argument : arguments) argv.push_back(argument.data());
  argv.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, descriptor, number);
  posix_spawn_file_actions_addclosefrom_np(&actions, std::max(number, STDERR_FILENO) + 1);
  const int error = posix_spawn(&id_, file.c_str(), &actions, nullptr, argv.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  if (error != 0) {
    id_ = -1;
    throw CameraFault(file + ": " + std::strerror(error));
  }
}

HelperProcess::~HelperProcess() {
  if (id_ > 0) {
    kill(id_, SIGKILL);  // the kernel then closes the camera
    waitpid(id_, nullptr, 0);
  }
}

std::string HelperProcess::exit_reason() {
  using namespace std::chrono_literals;
  // The kernel closes descriptors slightly before the exit status is available.
  int status = 0;
  for (int waited_ms = 0; waited_ms < kLiveParameters.helper_exit.count(); ++waited_ms) {
    if (waitpid(id_, &status, WNOHANG) == id_) {
      id_ = -1;
      return WIFSIGNALED(status) ? strsignal(WTERMSIG(status)) : WEXITSTATUS(status) != 0 ? "it failed" : "";
    }
    std::this_thread::sleep_for(1ms);
  }
  return "it closed its descriptor but still runs";
}

std::string list_of_helper(const char* program, std::chrono::milliseconds patience) {
  int ends[2];
  if (pipe(ends) != 0) return {};
  const Descriptor read_end(ends[0]);
  Descriptor write_end(ends[1]);
  std::string out;
  try {
    const HelperProcess helper(program, {"list"}, write_end.number(), STDOUT_FILENO);
    write_end = Descriptor();  // so that reading ends with the helper
    char piece[4096];
    pollfd waiting{read_end.number(), POLLIN, 0};
    for (ssize_t size = 1; size > 0 && poll(&waiting, 1, static_cast<int>(patience.count())) > 0;) {
      size = read(waiting.fd, piece, sizeof piece);
      out.append(piece, static_cast<std::size_t>(std::max<ssize_t>(size, 0)));
    }
  } catch (const CameraFault& e) {
    out = std::string("failed\t") + e.what() + "\n";
  }
  return out;
}

}  // namespace lumigraft::capture
