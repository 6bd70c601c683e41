#pragma once
// Detects leaks of memory and descriptors over repeated cycles of opening and closing a camera.
#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>

namespace lumigraft::test {

/// Number of cycles: `usual`, or LUMIGRAFT_CYCLES of the environment for a longer test.
inline int cycles(int usual) {
  const char* wanted = std::getenv("LUMIGRAFT_CYCLES");
  return wanted != nullptr ? std::atoi(wanted) : usual;
}

inline std::ptrdiff_t open_descriptors() {
  return std::distance(std::filesystem::directory_iterator("/proc/self/fd"), std::filesystem::directory_iterator());
}

inline long resident_kb() {
  std::ifstream in("/proc/self/status");
  for (std::string line; std::getline(in, line);) {
    if (line.rfind("VmRSS:", 0) == 0) {
      return std::atol(line.c_str() + 6);
    }
  }
  return 0;
}

/// Compares the state after the last cycle with that after the fifth; the first cycles fill caches.
class Leaks {
 public:
  void end_of_cycle() {
    ++cycles_;
    if (cycles_ == kFirst) {
      descriptors_ = open_descriptors();
      resident_kb_ = resident_kb();
    }
    if (cycles_ % kEvery == 0) {
      history_ += " " + std::to_string(resident_kb());
    }
  }
  void expect_none() const {
    if (cycles_ <= kFirst) {
      return;
    }
    EXPECT_LE(open_descriptors(), descriptors_);
#ifndef __SANITIZE_ADDRESS__  // AddressSanitizer keeps freed memory for a while
    EXPECT_LT(resident_kb(), resident_kb_ + kTolerated_kb) << "memory after " << cycles_ << " cycles";
#endif
    std::printf("%d cycles: %td descriptors, before %td; %ld kB of memory, before %ld%s%s\n", cycles_,
                open_descriptors(), descriptors_, resident_kb(), resident_kb_,
                history_.empty() ? "" : ", and after each 20:", history_.c_str());
  }

 private:
  static constexpr int kFirst = 5;
  static constexpr long kTolerated_kb = 8 * 1024;  ///< kept by the allocator, depending on timing
  static constexpr int kEvery = 20;
  int cycles_ = 0;
  std::string history_;
  std::ptrdiff_t descriptors_ = 0;
  long resident_kb_ = 0;
};

}  // namespace lumigraft::test
