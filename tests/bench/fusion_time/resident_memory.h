#pragma once
#include <unistd.h>

#include <fstream>

namespace lumigraft::test {

/// Of this process.
inline double resident_mb() {
  std::ifstream in("/proc/self/statm");
  double size = 0, resident = 0;
  in >> size >> resident;
  return resident * static_cast<double>(::sysconf(_SC_PAGESIZE)) / 1e6;
}

}  // namespace lumigraft::test
