#include "capture/libcamera_process.h"

#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <csignal>
#include <cstring>
#include <filesystem>

#include "capture/error.h"

namespace lumigraft::libcam {

HelperProcess::HelperProcess(std::vector<std::string> words, int theirs, int as) {
  const std::string program =
      (std::filesystem::read_symlink("/proc/self/exe").parent_path() / "lumigraft_libcamera").string();
  words.insert(words.begin(), program);
  std::vector<char*> argv;
  for (std::string& word : words) {
    argv.push_back(word.data());
  }
  argv.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, theirs, as);
  posix_spawn_file_actions_addclosefrom_np(&actions, std::max(as, STDERR_FILENO) + 1);
  const int error = posix_spawn(&id_, program.c_str(), &actions, nullptr, argv.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  if (error != 0) {
    id_ = -1;
    throw CameraFault(program + ": " + std::strerror(error));
  }
}

HelperProcess::~HelperProcess() {
  if (id_ > 0) {
    kill(id_, SIGKILL);  // the kernel closes its camera
    waitpid(id_, nullptr, 0);
  }
}

}  // namespace lumigraft::libcam
