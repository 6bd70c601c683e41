#pragma once
// Runs work on all cores. Results must not depend on the order of execution.
#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>
#include <thread>
#include <vector>

namespace lumigraft::relight {

constexpr int kRows = 4;  ///< of pixels per thread and block

/// Calls `work(first, last)` for blocks of [0, count), once each. If `work` throws, no further block starts, and the
/// first exception is rethrown after all threads have ended.
template <typename Work>
void for_each_block(int count, int block, Work work) {
  std::atomic<int> next = 0;
  std::mutex mutex;
  std::exception_ptr failure;
  const auto run = [&] {
    try {
      for (int first = next.fetch_add(block); first < count; first = next.fetch_add(block)) {
        work(first, std::min(first + block, count));
      }
    } catch (...) {
      next = count;
      const std::lock_guard lock(mutex);
      if (!failure) failure = std::current_exception();
    }
  };
  const int blocks = (count + block - 1) / block;
  {
    std::vector<std::jthread> others;
    for (int i = 1; i < std::min(static_cast<int>(std::thread::hardware_concurrency()), blocks); ++i) {
      others.emplace_back(run);
    }
    run();
  }
  if (failure) std::rethrow_exception(failure);
}

/// Calls `work(i)` for each i in [0, count), `block` of them at a time on a thread.
template <typename Index, typename Work>
void for_each_index(Index count, int block, Work work) {
  for_each_block(static_cast<int>(count), block, [&](int first, int last) {
    for (auto i = static_cast<Index>(first); i < static_cast<Index>(last); ++i) work(i);
  });
}

/// Calls `work(u, v)` for each pixel of an image, `rows` rows at a time on a thread.
template <typename Work>
void for_each_pixel(int width, int height, int rows, Work work) {
  for_each_index(height, rows, [&](int v) {
    for (int u = 0; u < width; ++u) work(u, v);
  });
}

}  // namespace lumigraft::relight
