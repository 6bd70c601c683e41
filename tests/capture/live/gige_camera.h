#pragma once
// The camera of fake_gige_camera.cpp, on the network for as long as it lives.
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

  /// `lost` is the share of its packets that it loses, `fault` what else the network does to its pictures.
  explicit GigeCamera(const std::string& lost = "0", const std::string& fault = "") {
    take_loopback();
    process_.emplace(std::vector<std::string>{LUMIGRAFT_FAKE_GIGE_CAMERA, "127.0.0.1", "GV77", lost, fault});
  }
  bool running() const { return process_->running(); }
  void signal(int number) const { process_->signal(number); }

  /// GigE Vision has one port an address: two programs of tests at once would answer each other's clients. Until the
  /// program ends the loopback is this one's; for those who look for a camera before there is one.
  static void take_loopback() {
    static const int turn = [] {
      const auto path = std::filesystem::temp_directory_path() / "lumigraft-gige-camera.lock";
      const int file = open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
      flock(file, LOCK_EX);
      return file;
    }();
    (void)turn;
  }

 private:
  std::optional<ChildProcess> process_;
};

}  // namespace lumigraft::test
