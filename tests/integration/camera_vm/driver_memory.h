#pragma once
// Finds out whether a frame is in the driver's memory.
#include <cstdint>
#include <fstream>
#include <span>
#include <sstream>
#include <string>

namespace lumigraft::test {

/// Whether the bytes lie in memory mapped from a file whose path contains `name`.
inline bool lies_in(std::span<const std::uint8_t> bytes, const std::string& name) {
  std::ifstream maps("/proc/self/maps");
  const auto begin = reinterpret_cast<std::uintptr_t>(bytes.data());
  for (std::string line; std::getline(maps, line);) {
    std::uintptr_t from = 0, to = 0;
    char dash = 0;
    std::istringstream(line) >> std::hex >> from >> dash >> to;
    if (begin >= from && begin + bytes.size() <= to) return line.find(name) != std::string::npos;
  }
  return false;
}

}  // namespace lumigraft::test
