#include "server/commands/gpu_probe.h"

#include <fcntl.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <exception>

#include "server/commands/parameters.h"

namespace lumigraft::server {
namespace {

constexpr int kSoftware = 10, kOther = 11;  // exit codes that a crash does not have

[[noreturn]] void probe(relight::gpu::Backend backend) {
  ::prctl(PR_SET_PDEATHSIG, SIGKILL);
  ::alarm(kCommands.gpu_probe_s);  // ends a process whose driver hangs
  const int nowhere = ::open("/dev/null", O_WRONLY | O_CLOEXEC);
  ::dup2(nowhere, STDOUT_FILENO);
  ::dup2(nowhere, STDERR_FILENO);
  try {
    ::_exit(relight::gpu::create_device(backend, {})->is_software() ? kSoftware : kOther);
  } catch (const std::exception&) {
    ::_exit(kOther);
  }
}

}  // namespace

bool only_software_device(relight::gpu::Backend backend) {
  const pid_t process = ::fork();
  if (process == 0) probe(backend);
  int status = 0;
  if (process < 0) return false;
  while (::waitpid(process, &status, 0) < 0) {
    if (errno != EINTR) return false;
  }
  return WIFEXITED(status) && WEXITSTATUS(status) == kSoftware;
}

}  // namespace lumigraft::server
