#pragma once
// The helper program as this one sees it (libcamera_messages.h). Included by .cpp files alone.
#include <sys/types.h>

#include <string>
#include <vector>

namespace lumigraft::libcam {

/// Runs lumigraft_libcamera, which lies beside this program, with these words; kills it at the end.
class HelperProcess {
 public:
  /// `theirs` becomes its descriptor `as`. Throws CameraFault.
  HelperProcess(std::vector<std::string> words, int theirs, int as);
  ~HelperProcess();
  HelperProcess(const HelperProcess&) = delete;
  HelperProcess& operator=(const HelperProcess&) = delete;

  pid_t id() const { return id_; }

 private:
  pid_t id_ = -1;
};

}  // namespace lumigraft::libcam
