#include "relight/tracing/parallel_for.h"

#include <gtest/gtest.h>

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

}  // namespace
}  // namespace lumigraft::relight
