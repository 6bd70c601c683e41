#include "server/publish/publish_queue.h"

#include <gtest/gtest.h>

namespace lumigraft::server {
namespace {

using std::chrono::milliseconds;

PublishQueue::Picture picture(StreamKind kind, std::uint32_t sequence) {
  StreamHeader header;
  header.kind = kind;
  header.sequence = sequence;
  return make_stream_message(header, {});
}

TEST(PublishQueue, BeginsWithAKeyFrame) {
  PublishQueue queue;
  const PublishQueue::Clock::time_point now{};
  EXPECT_EQ(queue.offer(picture(StreamKind::h264_delta, 1), now), 1u);
  EXPECT_TRUE(queue.needs_key());
  EXPECT_EQ(queue.take(), nullptr);
  EXPECT_EQ(queue.offer(picture(StreamKind::jpeg, 2), now), 0u) << "is not published";
  EXPECT_EQ(queue.offer(picture(StreamKind::h264_key, 2), now), 0u);
  EXPECT_EQ(queue.offer(picture(StreamKind::h264_delta, 3), now), 0u);
  EXPECT_EQ(queue.take()->header.sequence, 2u);
  EXPECT_EQ(queue.take()->header.sequence, 3u);
  EXPECT_EQ(queue.take(), nullptr);
}

/// While the network stalls no picture waits longer than a second, however many are made, and none is sent whose
/// predecessor was not.
TEST(PublishQueue, SkipsToTheNextKeyFrameWhereTheReaderStalls) {
  for (const int period_ms : {16, 33, 200, 900}) {
    PublishQueue queue;
    std::uint32_t sequence = 0;
    for (int ms = 0; ms < 20'000; ms += period_ms) {
      const bool key = sequence == 0 || ms % 2000 < period_ms;
      queue.offer(picture(key ? StreamKind::h264_key : StreamKind::h264_delta, ++sequence),
                  PublishQueue::Clock::time_point(milliseconds(ms)));
    }
    const PublishQueue::Picture first = queue.take();
    if (!first) continue;  // all were dropped, and the next key frame has not come yet
    EXPECT_EQ(first->header.kind, StreamKind::h264_key) << period_ms;
    std::uint32_t last = first->header.sequence;
    while (const PublishQueue::Picture next = queue.take()) {
      EXPECT_EQ(next->header.sequence, ++last) << period_ms;
    }
    EXPECT_EQ(last, sequence) << period_ms;
    EXPECT_LE((last - first->header.sequence) * static_cast<unsigned>(period_ms), 1000u) << period_ms;
  }
}

}  // namespace
}  // namespace lumigraft::server
