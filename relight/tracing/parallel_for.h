#pragma once
// Work on all cores. What is computed must not depend on the order.
#include <algorithm>
#include <atomic>
#include <thread>
#include <vector>

namespace lumigraft::relight {

/// Calls `work(first, last)` for blocks of [0, count), each once.
template <typename Work>
void for_each_block(int count, int block, Work work) {
  std::atomic<int> next = 0;
  const auto run = [&] {
    for (int first = next.fetch_add(block); first < count; first = next.fetch_add(block)) {
      work(first, std::min(first + block, count));
    }
  };
  const int blocks = (count + block - 1) / block;
  std::vector<std::jthread> others;
  for (int i = 1; i < std::min(static_cast<int>(std::thread::hardware_concurrency()), blocks); ++i) {
    others.emplace_back(run);
  }
  run();
}

}  // namespace lumigraft::relight
