#include "relight/tracing/parallel_for.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <stdexcept>
#include <thread>

namespace lumigraft::relight {
namespace {

TEST(ForEachBlock, CallsEachBlockOnce) {
  std::vector<int> calls(1000, 0);
  for_each_block(1000, 7, [&](int first, int last) {
    for (int i = first; i < last; ++i) ++calls[static_cast<std::size_t>(i)];
  });
  EXPECT_EQ(calls, std::vector<int>(1000, 1));
}

TEST(ForEachBlock, AnExceptionOfTheCallersBlockReachesIt) {
  EXPECT_THROW(for_each_block(1, 1, [](int, int) { throw std::bad_alloc(); }), std::bad_alloc);
}

// The caller's thread waits in its block until another thread has thrown.
TEST(ForEachBlock, AnExceptionOfAnotherThreadReachesTheCaller) {
  if (std::thread::hardware_concurrency() < 2) GTEST_SKIP() << "there are no other threads";
  const auto caller = std::this_thread::get_id();
  std::atomic<bool> thrown = false;
  std::atomic<int> at_work = 0;
  const auto work = [&](int, int) {
    ++at_work;
    if (std::this_thread::get_id() == caller) {
      while (!thrown) std::this_thread::yield();
      std::this_thread::sleep_for(std::chrono::milliseconds(20));
      --at_work;
      return;
    }
    --at_work;
    thrown = true;
    throw std::runtime_error("out of memory");
  };
  EXPECT_THROW(for_each_block(1000, 1, work), std::runtime_error);
  EXPECT_EQ(at_work, 0) << "no block is at work any more";
}

TEST(ForEachBlock, NoBlockBeginsAfterAnException) {
  std::atomic<int> calls = 0;
  EXPECT_THROW(for_each_block(100000, 1,
                              [&](int, int) {
                                ++calls;
                                throw std::runtime_error("each");
                              }),
               std::runtime_error);
  EXPECT_LE(calls, static_cast<int>(std::thread::hardware_concurrency()));
}

TEST(ForEachBlock, BlocksMayHaveBlocks) {
  std::atomic<int> calls = 0;
  for_each_block(20, 1, [&](int, int) {
    for_each_block(20, 1, [&](int, int) { for_each_block(20, 1, [&](int, int) { ++calls; }); });
  });
  EXPECT_EQ(calls, 20 * 20 * 20);
}

TEST(FoundInRows, IsInTheirOrder) {
  const std::vector<int> found = found_in_rows<int>(1000, [](int row, std::vector<int>& of_row) {
    for (int k = 0; k < row % 3; ++k) of_row.push_back(row);
  });
  EXPECT_EQ(found.size(), 999u);
  EXPECT_TRUE(std::ranges::is_sorted(found));
  EXPECT_TRUE((found_in_rows<int>(0, [](int, std::vector<int>& of_row) { of_row.push_back(1); }).empty()));
}

/// Another thread helps with a long job, and with a short one as soon as its part of that is done.
TEST(WorkerPool, HelpsWhoAskedLastFirst) {
  WorkerPool pool(1);
  std::atomic<int> long_parts = 0;
  std::atomic<bool> helped = false, stop = false;
  const auto slow = [&] {
    ++long_parts;
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
    return !stop;
  };
  std::jthread first([&] { pool.run(1000, slow); });
  while (long_parts < 4) std::this_thread::yield();
  const auto here = std::this_thread::get_id();
  pool.run(2, [&] {
    if (std::this_thread::get_id() != here) helped = true;
    return !helped;
  });
  EXPECT_TRUE(helped);
  stop = true;
}

TEST(WorkerPool, WithoutThreadsTheCallerDoesAll) {
  WorkerPool pool(0);
  int parts = 0;
  pool.run(5, [&] { return ++parts < 5; });
  EXPECT_EQ(parts, 5);
}

}  // namespace
}  // namespace lumigraft::relight
