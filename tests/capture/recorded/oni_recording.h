#pragma once
// Records an .oni file of the test device with OpenNI2's own recorder (oni_writer.cpp), which sometimes crashes.
#include <gtest/gtest.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <string>

namespace lumigraft::test {

inline void record_oni(std::string file, int pictures) {
  std::string program = LUMIGRAFT_ONI_WRITER, count = std::to_string(pictures);
  char* argv[] = {program.data(), file.data(), count.data(), nullptr};
  for (int attempt = 0; attempt < 10; ++attempt) {
    pid_t child = 0;
    ASSERT_EQ(posix_spawn(&child, argv[0], nullptr, nullptr, argv, environ), 0) << program;
    int status = 0;
    waitpid(child, &status, 0);
    if (WIFEXITED(status) && WEXITSTATUS(status) == 0) {
      return;
    }
  }
  FAIL() << "the recorder failed ten times";
}

}  // namespace lumigraft::test
