#pragma once
// Runs the GigE Vision camera of fake_gige_camera.cpp for the lifetime of an object.
#include <fcntl.h>
#include <sys/file.h>

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "capture/image.h"
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

/// Whether a frame of the camera is complete. The camera shows a ramp that grows by one, modulo 255, along rows and
/// columns; a mix of two frames breaks it.
inline bool is_ramp(const capture::Image<std::uint8_t>& grey) {
  const auto follows = [](std::uint8_t after, std::uint8_t before) { return after == (before + 1) % 255; };
  for (int y = 0; y < grey.height; ++y) {
    for (int x = 0; x < grey.width; ++x) {
      if ((x > 0 && !follows(grey.at(x, y), grey.at(x - 1, y))) ||
          (y > 0 && !follows(grey.at(x, y), grey.at(x, y - 1)))) {
        return false;
      }
    }
  }
  return true;
}

}  // namespace lumigraft::test
