#pragma once
// What a driver or its validation layer says while it works, kept until someone can throw it.
#include <mutex>
#include <string>
#include <vector>

namespace lumigraft::relight::gpu {

/// It may speak from any thread.
class Messages {
 public:
  explicit Messages(std::string speaker) : speaker_(std::move(speaker)) {}
  ~Messages();  ///< what nobody could throw any more goes to stderr
  Messages(const Messages&) = delete;
  Messages& operator=(const Messages&) = delete;

  void add(std::string text);
  std::string take();   ///< everything since the last call; empty: nothing was said
  void throw_if_any();  ///< GpuError with the same

 private:
  std::string speaker_;
  std::mutex mutex_;
  std::vector<std::string> texts_;
};

}  // namespace lumigraft::relight::gpu
