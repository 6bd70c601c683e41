#include "server/stream/viewer_queue.h"

#include <gtest/gtest.h>

#include "server/stream/parameters.h"

namespace lumigraft::server {
namespace {

std::shared_ptr<const StreamMessage> picture(StreamKind kind, std::uint32_t sequence) {
  StreamHeader header;
  header.kind = kind;
  header.sequence = sequence;
  return make_stream_message(header, {});
}

using Time = ViewerQueue::Clock::time_point;
using std::chrono::milliseconds;

/// Such as "k3 d4": kinds and sequence numbers of all queued messages.
std::string drain(ViewerQueue& queue, Time now = {}) {
  std::string out;
  while (const auto next = queue.next(now)) {
    if (const auto* text = std::get_if<std::string>(&*next)) {
      out += *text + " ";
      continue;
    }
    const StreamHeader& h = std::get<std::shared_ptr<const StreamMessage>>(*next)->header;
    out += std::string(1, " ckdj"[static_cast<int>(h.kind)]) + std::to_string(h.sequence) + " ";
  }
  return out;
}

TEST(ViewerQueue, GivesNothingThatWasNotWanted) {
  ViewerQueue queue;
  queue.offer(picture(StreamKind::jpeg, 1), {});
  queue.offer(picture(StreamKind::h264_key, 1), {});
  EXPECT_EQ(drain(queue), "");
  queue.want(Codec::jpeg);
  queue.offer(picture(StreamKind::h264_key, 2), {});
  queue.offer(picture(StreamKind::jpeg, 2), {});
  EXPECT_EQ(drain(queue), "j2 ");
}

TEST(ViewerQueue, TheNewestJpegWins) {
  ViewerQueue queue;
  queue.want(Codec::jpeg);
  EXPECT_FALSE(queue.offer(picture(StreamKind::jpeg, 1), {}));
  EXPECT_TRUE(queue.offer(picture(StreamKind::jpeg, 2), {}));
  EXPECT_EQ(drain(queue), "j2 ");
}

TEST(ViewerQueue, H264BeginsWithConfigAndKey) {
  ViewerQueue queue;
  queue.offer(picture(StreamKind::config, 0), {});
  queue.want(Codec::h264);
  EXPECT_TRUE(queue.offer(picture(StreamKind::h264_delta, 1), {}));
  EXPECT_EQ(drain(queue), "");
  queue.offer(picture(StreamKind::h264_key, 2), {});
  queue.offer(picture(StreamKind::h264_delta, 3), {});
  EXPECT_EQ(drain(queue), "c0 k2 d3 ");
  queue.offer(picture(StreamKind::h264_key, 4), {});
  EXPECT_EQ(drain(queue), "k4 ") << "the config is sent once";
}

TEST(ViewerQueue, ASlowViewerSkipsToTheNextKeyFrame) {
  ViewerQueue queue;
  queue.want(Codec::h264);
  queue.offer(picture(StreamKind::h264_key, 0), {});
  for (std::uint32_t i = 1; i <= kStream.max_queued; ++i) {
    queue.offer(picture(StreamKind::h264_delta, i), {});
  }
  EXPECT_EQ(drain(queue), "") << "a broken run is never sent";
  EXPECT_TRUE(queue.offer(picture(StreamKind::h264_delta, 20), {}));
  queue.offer(picture(StreamKind::h264_key, 21), {});
  queue.offer(picture(StreamKind::h264_delta, 22), {});
  EXPECT_EQ(drain(queue), "k21 d22 ");
}

TEST(ViewerQueue, WhoAcknowledgesIsHeldBackUntilItDoesAgain) {
  ViewerQueue queue;
  queue.want(Codec::jpeg);
  for (std::uint32_t i = 0; i < 5; ++i) {
    queue.offer(picture(StreamKind::jpeg, i), {});
    EXPECT_NE(drain(queue), "") << "who has never acknowledged is not waited for";
  }
  EXPECT_TRUE(queue.acknowledge(4, {}));
  EXPECT_FALSE(queue.acknowledge(4, {})) << "said before";
  EXPECT_FALSE(queue.acknowledge(999, {})) << "never sent";
  queue.offer(picture(StreamKind::jpeg, 5), {});
  EXPECT_EQ(drain(queue), "j5 ");
  queue.offer(picture(StreamKind::jpeg, 6), {});
  queue.offer(picture(StreamKind::jpeg, 7), {});
  EXPECT_EQ(drain(queue), "");
  EXPECT_TRUE(queue.acknowledge(5, {}));
  EXPECT_EQ(drain(queue), "j7 ");
}

TEST(ViewerQueue, LostAcknowledgementsDoNotHoldBackForEver) {
  ViewerQueue queue;
  queue.want(Codec::jpeg);
  queue.offer(picture(StreamKind::jpeg, 0), {});
  drain(queue);
  queue.acknowledge(0, {});
  int sent = 0;
  for (std::uint32_t i = 1; i <= 100; ++i) {  // 10 s
    const Time now{milliseconds(100 * i)};
    queue.offer(picture(StreamKind::jpeg, i), now);
    sent += drain(queue, now).empty() ? 0 : 1;
  }
  EXPECT_EQ(sent, 4) << "after 1, 2 and 4 s: who stands still finds no queue of old pictures afterwards";
  queue.offer(picture(StreamKind::jpeg, 101), {});
  drain(queue, Time{std::chrono::seconds(100)});
  EXPECT_TRUE(queue.acknowledge(101, Time{std::chrono::seconds(100)}));
}

TEST(ViewerQueue, AsksForAKeyFrameOnceItCanSendIt) {
  ViewerQueue queue;
  queue.want(Codec::h264);
  EXPECT_TRUE(queue.wants_key({}));
  queue.offer(picture(StreamKind::h264_key, 1), {});
  EXPECT_FALSE(queue.wants_key({}));
  drain(queue);
  queue.acknowledge(1, {});
  queue.offer(picture(StreamKind::h264_delta, 2), {});
  drain(queue);
  for (std::uint32_t i = 0; i <= kStream.max_queued; ++i) queue.offer(picture(StreamKind::h264_delta, 3 + i), {});
  EXPECT_FALSE(queue.wants_key({})) << "the viewer stands still";
  queue.acknowledge(2, {});
  EXPECT_EQ(drain(queue), "");
  EXPECT_TRUE(queue.wants_key({}));
}

TEST(ViewerQueue, TextGoesFirstAndTheNewestOfAKindWins) {
  ViewerQueue queue;
  queue.want(Codec::jpeg);
  queue.offer(picture(StreamKind::jpeg, 1), {});
  queue.offer_text("stats", "s1");
  queue.offer_text("hello", "h");
  queue.offer_text("stats", "s2");
  EXPECT_EQ(drain(queue), "h s2 j1 ");
}

}  // namespace
}  // namespace lumigraft::server
