#pragma once
// Runs work on all cores. Results must not depend on the order of execution.
#include <algorithm>
#include <atomic>
#include <exception>
#include <mutex>
#include <vector>

#include "relight/tracing/worker_pool.h"

namespace lumigraft::relight {

constexpr int kRows = 4;  ///< of pixels per thread and block

/// Calls `work(first, last)` for blocks of [0, count), once each. If `work` throws, no further block starts, and the
/// first exception is rethrown after all calls have ended.
template <typename Work>
void for_each_block(int count, int block, Work work) {
  std::atomic<int> next = 0;
  std::mutex mutex;
  std::exception_ptr failure;
  const auto one_block = [&] {
    const int first = next.fetch_add(block);
    if (first >= count) return false;
    try {
      work(first, std::min(first + block, count));
    } catch (...) {
      next = count;
      const std::lock_guard lock(mutex);
      if (!failure) failure = std::current_exception();
    }
    return true;
  };
  WorkerPool::shared().run((count + block - 1) / block, one_block);
  if (failure) std::rethrow_exception(failure);
}

/// Calls `work(i)` for each i in [0, count), `block` of them at a time on a thread.
template <typename Index, typename Work>
void for_each_index(Index count, int block, Work work) {
  for_each_block(static_cast<int>(count), block, [&](int first, int last) {
    for (auto i = static_cast<Index>(first); i < static_cast<Index>(last); ++i) work(i);
  });
}

/// What `add(row, found)` appends to a list for each row, in their order.
template <typename Item, typename Add>
std::vector<Item> found_in_rows(int rows, Add add) {
  constexpr int kBand = 4 * kRows;
  std::vector<std::vector<Item>> bands(static_cast<std::size_t>((std::max(rows, 0) + kBand - 1) / kBand));
  for_each_index(bands.size(), 1, [&](std::size_t k) {
    const int first = kBand * static_cast<int>(k);
    for (int row = first; row < std::min(first + kBand, rows); ++row) add(row, bands[k]);
  });
  std::size_t count = 0;
  for (const std::vector<Item>& band : bands) count += band.size();
  std::vector<Item> all;
  all.reserve(count);
  for (const std::vector<Item>& band : bands) all.insert(all.end(), band.begin(), band.end());
  return all;
}

/// Calls `work(u, v)` for each pixel of an image, `rows` rows at a time on a thread.
template <typename Work>
void for_each_pixel(int width, int height, int rows, Work work) {
  for_each_index(height, rows, [&](int v) {
    for (int u = 0; u < width; ++u) work(u, v);
  });
}

}  // namespace lumigraft::relight
