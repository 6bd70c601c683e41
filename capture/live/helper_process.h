#pragma once
// Runs a camera library that may crash in a helper program. Included by .cpp files alone.
#include <sys/types.h>

#include <chrono>
#include <string>
#include <vector>

namespace lumigraft::capture {

/// Runs `program`, in the folder of this executable, with these arguments; the destructor kills it.
class HelperProcess {
 public:
  /// The helper gets `descriptor` as its descriptor `number`, and no others but the standard ones. Throws CameraFault.
  HelperProcess(const char* program, std::vector<std::string> arguments, int descriptor, int number);
  ~HelperProcess();
  HelperProcess(const HelperProcess&) = delete;
  HelperProcess& operator=(const HelperProcess&) = delete;

  pid_t id() const { return id_; }
  /// After it has closed its descriptor: why it ended, one line; empty if it ended normally.
  std::string exit_reason();

 private:
  pid_t id_ = -1;
};

/// What `program list` writes to its standard output, until it is silent for `patience`; "failed\tREASON\n" if it
/// cannot be run.
std::string list_of_helper(const char* program, std::chrono::milliseconds patience);

}  // namespace lumigraft::capture
