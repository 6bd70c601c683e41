#pragma once
// Runs the GigE Vision camera of fake_gige_camera.cpp for the lifetime of an object.
#include <fcntl.h>
#include <sys/file.h>

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "tests/capture/child_process.h"

namespace lumigraft::test {

class GigeCamera {
 public:
  static constexpr char kName[] = "Aravis-Fake-GV77";

  /// `lost` is the fraction of packets that are lost, `fault` a fault of the network (fake_gige_camera.cpp).
  explicit GigeCamera(const std::string& lost = "0", const std::string& fault = "") {
    take_loopback();
    process_.emplace(std::vector<std::string>{LUMIGRAFT_FAKE_GIGE_CAMERA, "127.0.0.1", "GV77", lost, fault});
  }
  bool running() const { return process_->running(); }
  void signal(int number) const { process_->signal(number); }

  /// Locks the loopback address for this process until it ends. GigE Vision has one port per address, so cameras of two
  /// test programs would answer each other's clients. For tests that look for a camera before it runs.
  static void take_loopback() {
    static const int lock = [] {
      const auto path = std::filesystem::temp_directory_path() / "lumigraft-gige-camera.lock";
      const int file = open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
      flock(file, LOCK_EX);
      return file;
    }();
    (void)lock;
  }

 private:
  std::optional<ChildProcess> process_;
};

}  // namespace lumigraft::test
