#pragma once
// Runs the program as a child process of a test and kills it at the end.
#include <fcntl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <chrono>
#include <csignal>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <thread>
#include <vector>

namespace lumigraft::server {

class Program {
  using Clock = std::chrono::steady_clock;

 public:
  Program(const std::filesystem::path& scratch, std::vector<std::string> words) : log_(scratch / "stderr.txt") {
    words.insert(words.begin(), LUMIGRAFT_PROGRAM);
    std::vector<char*> argv;
    for (std::string& word : words) {
      argv.push_back(word.data());
    }
    argv.push_back(nullptr);
    std::filesystem::remove(log_);  // of a previous program
    pid_ = fork();
    if (pid_ == 0) {
      const int log = open(log_.c_str(), O_CREAT | O_TRUNC | O_WRONLY, 0600);
      dup2(log, 2);
      execv(argv[0], argv.data());
      _exit(127);
    }
  }
  ~Program() {
    if (pid_ > 0) {
      kill(pid_, SIGKILL);
      waitpid(pid_, nullptr, 0);
    }
  }
  Program(const Program&) = delete;
  Program& operator=(const Program&) = delete;

  int wait() {
    int status = 0;
    waitpid(pid_, &status, 0);
    pid_ = -1;
    return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
  }
  void signal(int number) const { kill(pid_, number); }
  std::string stderr_text() const {
    std::ifstream in(log_);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  /// The port in the line "serving http://127.0.0.1:PORT/"; 0 after the timeout.
  std::uint16_t port() const {
    const Clock::time_point deadline = Clock::now() + std::chrono::seconds(60);
    while (Clock::now() < deadline) {
      const std::string text = stderr_text();
      const std::size_t at = text.find("http://127.0.0.1:");
      if (at != std::string::npos && text.find('/', at + 17) != std::string::npos) {
        return static_cast<std::uint16_t>(std::stoi(text.substr(at + 17)));
      }
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
    }
    return 0;
  }

 private:
  std::filesystem::path log_;
  pid_t pid_;
};

}  // namespace lumigraft::server
