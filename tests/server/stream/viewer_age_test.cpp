// The age of pictures that a viewer has shown, with a simulated clock, network and viewer.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <deque>
#include <limits>
#include <vector>

#include "server/stream/viewer_queue.h"

namespace lumigraft::server {
namespace {

constexpr double kBegin_s = 1, kStall_s = 20, kEnd_s = 60;

/// Times in seconds.
struct Viewer {
  double rate_hz = 30;
  Codec codec = Codec::jpeg;
  double network_s = 0;     ///< one way
  double work_s = 0;        ///< to decode and show a picture; one at a time
  double stall_s = 0;       ///< from kStall_s on it shows nothing for so long
  double later_work_s = 0;  ///< from kStall_s on, in place of work_s; 0: the same
  double uneven = 0;        ///< every other picture is made so many periods late
};

struct Shown {
  double when_s, age_s;
};

ViewerQueue::Clock::time_point at(double s) {
  return ViewerQueue::Clock::time_point(std::chrono::nanoseconds(std::llround(1e9 * s)));
}

/// Pictures are made at the rate; a key frame where it is asked for, at most two a second. H.264 is not encoded while
/// the viewer cannot be sent a picture.
std::vector<Shown> watch(const Viewer& viewer) {
  struct Picture {
    std::uint32_t sequence;
    double s;  ///< when it arrives at the viewer, or its acknowledgement at the server
  };
  ViewerQueue queue;
  queue.want(viewer.codec);
  queue.network_trip(std::chrono::nanoseconds(std::llround(2e9 * viewer.network_s)));
  std::vector<double> made_s;
  std::deque<Picture> sent, acknowledgements;
  std::vector<Shown> shown;
  double free_s = 0, last_key_s = -1;
  const auto send = [&](double now_s) {
    while (const auto next = queue.next(at(now_s))) {
      const auto* message = std::get_if<std::shared_ptr<const StreamMessage>>(&*next);
      sent.push_back({(*message)->header.sequence, now_s + viewer.network_s});
    }
  };
  const auto make = [&](double now_s) {
    if (viewer.codec == Codec::h264 && !queue.ready(at(now_s))) {
      made_s.push_back(now_s);
      return;
    }
    const bool key = queue.wants_key(at(now_s)) && now_s - last_key_s >= 0.5;
    if (key) last_key_s = now_s;
    StreamHeader header;
    header.kind = viewer.codec == Codec::jpeg ? StreamKind::jpeg : key ? StreamKind::h264_key : StreamKind::h264_delta;
    header.sequence = static_cast<std::uint32_t>(made_s.size());
    made_s.push_back(now_s);
    queue.offer(make_stream_message(header, {}), at(now_s));
    send(now_s);
  };
  constexpr double kNever = std::numeric_limits<double>::infinity();
  for (;;) {
    const double late = made_s.size() % 2 == 1 ? viewer.uneven : 0;
    const double make_s = (static_cast<double>(made_s.size()) + late) / viewer.rate_hz;
    const double acknowledged_s = acknowledgements.empty() ? kNever : acknowledgements.front().s;
    double show_s = kNever;
    if (!sent.empty()) {
      double begin_s = std::max(sent.front().s, free_s);
      if (begin_s >= kStall_s && begin_s < kStall_s + viewer.stall_s) begin_s = kStall_s + viewer.stall_s;
      show_s = begin_s + (begin_s >= kStall_s && viewer.later_work_s > 0 ? viewer.later_work_s : viewer.work_s);
    }
    const double now_s = std::min({make_s, acknowledged_s, show_s});
    if (now_s > kEnd_s) return shown;
    if (now_s == show_s) {
      const Picture picture = sent.front();
      sent.pop_front();
      free_s = now_s;
      shown.push_back({now_s, now_s - made_s[picture.sequence]});
      acknowledgements.push_back({picture.sequence, now_s + viewer.network_s});
    } else if (now_s == acknowledged_s) {
      queue.acknowledge(acknowledgements.front().sequence, at(now_s));
      acknowledgements.pop_front();
      send(now_s);
    } else {
      make(now_s);
    }
  }
}

/// 95 of 100 are younger.
double age_of_95_s(const std::vector<Shown>& shown, double from_s, double to_s) {
  std::vector<double> ages;
  for (const Shown& one : shown)
    if (one.when_s >= from_s && one.when_s < to_s) ages.push_back(one.age_s);
  if (ages.empty()) return std::numeric_limits<double>::infinity();
  std::ranges::sort(ages);
  return ages[static_cast<std::size_t>(0.95 * static_cast<double>(ages.size()))];
}

double shown_hz(const std::vector<Shown>& shown, double from_s, double to_s) {
  return static_cast<double>(std::ranges::count_if(
             shown, [&](const Shown& one) { return one.when_s >= from_s && one.when_s < to_s; })) /
         (to_s - from_s);
}

constexpr double kRates_hz[] = {12, 30, 60};

/// H.264 cannot be skipped frame by frame: of a viewer that is too slow, one more waits.
TEST(ViewerAge, OfAViewerThatIsTooSlowIsBelowTwoPeriodsOfWhatItShows) {
  for (const double rate_hz : kRates_hz) {
    for (const Codec codec : {Codec::jpeg, Codec::h264}) {
      for (const double slower : {0.9, 1.1, 1.5}) {
        for (const double stall_s : {0.0, 0.3, 3.0}) {
          SCOPED_TRACE(testing::Message() << rate_hz << " Hz, " << (codec == Codec::jpeg ? "JPEG" : "H.264")
                                          << ", takes " << slower << " periods, stands still for " << stall_s << " s");
          const double work_s = slower / rate_hz, period_s = std::max(work_s, 1 / rate_hz);
          const double bound_s = (codec == Codec::jpeg || slower < 1 ? 2 : 3) * period_s;
          const auto shown = watch({.rate_hz = rate_hz, .codec = codec, .work_s = work_s, .stall_s = stall_s});
          EXPECT_LE(age_of_95_s(shown, kBegin_s, kStall_s), bound_s + 1e-9);
          const double over_s = kStall_s + stall_s + 2;
          EXPECT_LE(age_of_95_s(shown, over_s, over_s + 5), bound_s + 1e-9);
          EXPECT_LE(age_of_95_s(shown, over_s, kEnd_s), bound_s + 1e-9);
          if (codec == Codec::jpeg) {
            EXPECT_GT(shown_hz(shown, over_s, kEnd_s), 0.95 / period_s);
          }
        }
      }
    }
  }
}

TEST(ViewerAge, AFarViewerHasTheWholeRateAndNoQueue) {
  for (const double rate_hz : kRates_hz) {
    for (const Codec codec : {Codec::jpeg, Codec::h264}) {
      for (const double network_s : {0.02, 0.08, 0.12}) {
        SCOPED_TRACE(testing::Message() << rate_hz << " Hz, " << (codec == Codec::jpeg ? "JPEG" : "H.264") << ", "
                                        << network_s << " s away");
        const auto shown = watch(
            {.rate_hz = rate_hz, .codec = codec, .network_s = network_s, .work_s = 0.3 / rate_hz, .stall_s = 0.5});
        EXPECT_LT(age_of_95_s(shown, 5, kStall_s), network_s + 2 / rate_hz);
        EXPECT_LT(age_of_95_s(shown, kStall_s + 2.5, kEnd_s), network_s + 2 / rate_hz);
        EXPECT_GT(shown_hz(shown, 10, kStall_s), 0.95 * rate_hz) << "after one more picture a round trip was tried";
        EXPECT_GT(shown_hz(shown, kStall_s + 2.5, kEnd_s), 0.9 * rate_hz);
      }
    }
  }
}

TEST(ViewerAge, AViewerThatBecomesSlowHasNoQueueAfterTwoSeconds) {
  for (const double rate_hz : kRates_hz) {
    SCOPED_TRACE(testing::Message() << rate_hz << " Hz");
    const auto shown =
        watch({.rate_hz = rate_hz, .work_s = 0.5 / rate_hz, .later_work_s = 1.1 / rate_hz, .uneven = 0.7});
    EXPECT_LE(age_of_95_s(shown, 1, kStall_s), 1 / rate_hz);
    EXPECT_LE(age_of_95_s(shown, kStall_s + 2, kStall_s + 12), 2.2 / rate_hz);
  }
}

}  // namespace
}  // namespace lumigraft::server
