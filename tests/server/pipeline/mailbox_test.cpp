#include "server/pipeline/mailbox.h"

#include <gtest/gtest.h>

#include <thread>

namespace lumigraft::server {
namespace {

using std::chrono::milliseconds;

TEST(Mailbox, HoldsTheNewestAndCountsWhatItDropped) {
  Mailbox<int> box("slow");
  EXPECT_FALSE(box.put(1));
  EXPECT_TRUE(box.put(2));
  EXPECT_TRUE(box.put(3));
  EXPECT_EQ(box.take(milliseconds(0)), 3);
  EXPECT_EQ(box.take(milliseconds(0)), std::nullopt);
  EXPECT_FALSE(box.put(4));
  EXPECT_EQ(box.dropped(), 2u);
  EXPECT_EQ(box.reader(), "slow");
}

TEST(Mailbox, CloseWakesTheReaderAndForgets) {
  Mailbox<int> box("reader");
  std::optional<int> taken = 7;
  std::thread reader([&] { taken = box.take(std::chrono::hours(1)); });
  box.close();
  reader.join();
  EXPECT_EQ(taken, std::nullopt);
  EXPECT_FALSE(box.put(1));
  EXPECT_EQ(box.take(milliseconds(0)), std::nullopt);
}

TEST(Mailbox, AWriterCanWaitUntilTheReaderIsReady) {
  Mailbox<int> box("reader");
  EXPECT_TRUE(box.wait_until_taken(milliseconds(0)));
  box.put(1);
  EXPECT_FALSE(box.wait_until_taken(milliseconds(1)));
  std::thread reader([&] { box.take(std::chrono::seconds(10)); });
  EXPECT_TRUE(box.wait_until_taken(std::chrono::seconds(10)));
  reader.join();
}

TEST(Mailbox, ASlowReaderSeesGrowingItemsAndNoneTwice) {
  Mailbox<int> box("reader");
  std::thread writer([&] {
    for (int i = 1; i <= 5000; ++i) {
      box.put(i);
    }
  });
  int last = 0, count = 0;
  while (last < 5000) {
    const std::optional<int> item = box.take(milliseconds(1000));
    ASSERT_TRUE(item);
    ASSERT_GT(*item, last);
    last = *item;
    ++count;
  }
  writer.join();
  EXPECT_EQ(box.dropped() + static_cast<std::uint64_t>(count), 5000u);
}

}  // namespace
}  // namespace lumigraft::server
