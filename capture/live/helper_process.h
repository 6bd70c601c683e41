#pragma once
// A program of ours beside this one, in which a library runs that may crash. Included by .cpp files alone.
#include <sys/types.h>

#include <string>
#include <vector>

namespace lumigraft::capture {

/// Runs `program`, which lies beside this one, with these words; kills it at the end.
class HelperProcess {
 public:
  /// `theirs` becomes its descriptor `as`, the only one beside the standard ones. Throws CameraFault.
  HelperProcess(const char* program, std::vector<std::string> words, int theirs, int as);
  ~HelperProcess();
  HelperProcess(const HelperProcess&) = delete;
  HelperProcess& operator=(const HelperProcess&) = delete;

  pid_t id() const { return id_; }
  /// For one that has closed its descriptor: what ended it, on one line; empty where it ended as it should.
  std::string how_it_ended();

 private:
  pid_t id_ = -1;
};

}  // namespace lumigraft::capture
