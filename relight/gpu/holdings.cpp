#include "relight/gpu/holdings.h"

#include <algorithm>

namespace lumigraft::relight::gpu {

void Holdings::add(const std::string& name, std::size_t bytes) {
  Holding& held = by_name_[name];
  held.name = name;
  ++held.count;
  held.bytes += bytes;
  bytes_ += bytes;
  max_bytes_ = std::max(max_bytes_, bytes_);
}

void Holdings::remove(const std::string& name, std::size_t bytes) {
  const auto held = by_name_.find(name);
  held->second.bytes -= bytes;
  if (--held->second.count == 0) by_name_.erase(held);
  bytes_ -= bytes;
}

std::vector<Holding> Holdings::list() const {
  std::vector<Holding> all;
  for (const auto& [name, held] : by_name_) all.push_back(held);
  std::stable_sort(all.begin(), all.end(), [](const Holding& a, const Holding& b) { return a.bytes > b.bytes; });
  return all;
}

std::string megabytes_text(std::size_t bytes) { return std::to_string((bytes + 500'000) / 1'000'000) + " MB"; }

}  // namespace lumigraft::relight::gpu
