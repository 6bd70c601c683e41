#pragma once
// Collects messages of a driver or its validation layer until they can be thrown.
#include <mutex>
#include <string>
#include <vector>

namespace lumigraft::relight::gpu {

/// Messages may arrive on any thread.
class Messages {
 public:
  explicit Messages(std::string speaker) : speaker_(std::move(speaker)) {}
  ~Messages();  ///< prints messages that were never thrown to stderr

  void add(std::string text);
  std::string take();   ///< all messages since the last call; empty: none
  void throw_if_any();  ///< throws them as GpuError

 private:
  std::string speaker_;
  std::mutex mutex_;
  std::vector<std::string> texts_;
};

}  // namespace lumigraft::relight::gpu
