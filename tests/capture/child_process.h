#pragma once
// Runs a program during a test and kills it at the end.
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <string>
#include <vector>

namespace lumigraft::test {

class ChildProcess {
 public:
  /// Returns when the program has written to its standard output, or has ended.
  explicit ChildProcess(std::vector<std::string> arguments) {
    int ends[2];
    if (pipe(ends) != 0) {
      return;
    }
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_adddup2(&actions, ends[1], 1);
    posix_spawn_file_actions_addclose(&actions, ends[0]);
    std::vector<char*> argv;
    for (std::string& argument : arguments) {
      argv.push_back(argument.data());
    }
    argv.push_back(nullptr);
    running_ = posix_spawn(&pid_, argv[0], &actions, nullptr, argv.data(), environ) == 0;
    posix_spawn_file_actions_destroy(&actions);
    close(ends[1]);
    char output[8] = {};
    running_ = running_ && read(ends[0], output, sizeof output) > 0;
    close(ends[0]);
  }
  ~ChildProcess() {
    if (pid_ > 0) {
      kill(pid_, SIGKILL);
      waitpid(pid_, nullptr, 0);
    }
  }
  ChildProcess(const ChildProcess&) = delete;
  ChildProcess& operator=(const ChildProcess&) = delete;

  bool running() const { return running_; }
  void signal(int number) const { kill(pid_, number); }

 private:
  pid_t pid_ = -1;
  bool running_ = false;
};

}  // namespace lumigraft::test
