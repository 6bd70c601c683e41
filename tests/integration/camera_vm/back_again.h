#pragma once
// Repeated removal and return of a camera.
#include <gtest/gtest.h>

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <cstdio>
#include <functional>
#include <optional>
#include <string>

#include "capture/live/live_source.h"
#include "tests/capture/live/leaks.h"

namespace lumigraft::test {

/// The next complete frame after skipping `after` complete frames.
inline std::optional<capture::Frame> frame_of(capture::Source& source, int after = 0) {
  for (int i = 0; i < 40; ++i) {
    const auto item = source.next(std::chrono::milliseconds(3000));
    if (const auto* picture = item ? std::get_if<capture::Frame>(&*item) : nullptr;
        picture != nullptr && after-- <= 0) {
      return *picture;
    }
  }
  ADD_FAILURE() << "no picture; " << source.fault();
  return std::nullopt;
}

/// Longest time until a camera that the system has found again delivers frames.
inline constexpr std::chrono::nanoseconds kBackWithin = std::chrono::seconds(2);

/// Checks that the source reports `fault` while its camera is away, delivers frames soon after its return with
/// increasing sequence numbers, and leaks nothing. `longest` measures the allowed time whenever the camera is away; the
/// largest value counts, since the speed of a busy machine varies.
template <typename Go, typename Return>
void expect_back_again(
    capture::LiveSource& source, int usual_cycles, const std::string& fault, const Go& go, const Return& come_back,
    const std::function<std::chrono::nanoseconds()>& longest = [] { return kBackWithin; }) {
  using Clock = std::chrono::steady_clock;
  std::optional<std::uint64_t> last;
  Leaks leaks;
  std::chrono::nanoseconds slowest{}, within{};
  for (int cycle = 0; cycle < cycles(usual_cycles); ++cycle) {
    const auto picture = frame_of(source);
    ASSERT_TRUE(picture);
    EXPECT_TRUE(!last || picture->stamp.sequence > *last);
    last = picture->stamp.sequence;
    go();
    const Clock::time_point begin = Clock::now();
    while (source.fault() != fault && Clock::now() - begin < std::chrono::seconds(10)) {
      source.next(std::chrono::milliseconds(20));
    }
    EXPECT_EQ(source.fault(), fault);
    while (source.next(std::chrono::milliseconds(0))) {
    }
    within = std::max(within, longest());
    come_back();
    const Clock::time_point back = Clock::now();
    ASSERT_TRUE(frame_of(source));
    slowest = std::max<std::chrono::nanoseconds>(slowest, Clock::now() - back);
    leaks.end_of_cycle();
  }
  if (slowest >= within) {  // the machine may have become slower: measure again
    go();
    within = std::max(within, longest());
    come_back();
  }
  EXPECT_LT(slowest, within);
  std::printf("back within %.2f s\n", 1e-9 * static_cast<double>(slowest.count()));
  leaks.expect_none();
}

}  // namespace lumigraft::test
