#include "capture/sync/fisheye_reader.h"

#include <gtest/gtest.h>

#include <deque>

namespace lumigraft::capture {
namespace {

using namespace std::chrono_literals;
using Lines = std::vector<std::string>;

Frame fisheye_frame(std::uint64_t sequence, std::int64_t time_ms) {
  Frame picture;
  picture.stamp = {time_ms * 1'000'000, 0, sequence};
  picture.stream = Stream::fisheye;
  return picture;
}

/// What waits at a live camera; more may be put there.
class Waiting : public Source {
 public:
  std::optional<SourceItem> next(std::chrono::milliseconds) override {
    if (items.empty()) return std::nullopt;
    SourceItem item = std::move(items.front());
    items.pop_front();
    return item;
  }
  bool finished() const override { return false; }
  void rewind() override {}
  std::string fault() const override { return away; }
  std::string take_warning() override { return std::exchange(warning, ""); }

  std::deque<SourceItem> items;
  std::string away, warning;
};

/// "sequence sequence ..." of the pictures of one time, and warnings after it.
Lines next(FisheyeReader& reader) {
  const auto seen = reader.next(0ms);
  if (!seen) return {};
  std::string sequences;
  for (const auto& picture : seen->frames) {
    sequences += (sequences.empty() ? "" : " ") + std::to_string(picture->stamp.sequence);
  }
  Lines lines{sequences};
  lines.insert(lines.end(), seen->warnings.begin(), seen->warnings.end());
  return lines;
}

TEST(FisheyeReader, GivesTheNewestFrameOrBracket) {
  const auto camera = std::make_shared<Waiting>();
  FisheyeReader reader(camera, -30'000'000);
  EXPECT_EQ(next(reader), Lines());
  camera->items = {fisheye_frame(0, 100), fisheye_frame(1, 133)};
  EXPECT_EQ(next(reader), Lines{"1"});
  camera->items = {fisheye_frame(2, 166), fisheye_frame(3, 200), fisheye_frame(4, 200), fisheye_frame(5, 200)};
  EXPECT_EQ(next(reader), Lines{"3 4 5"});
  camera->items = {fisheye_frame(6, 233)};
  EXPECT_EQ(reader.next(0ms)->frames.at(0)->stamp.time_ns, 203'000'000) << "on the colour camera's clock";
}

TEST(FisheyeReader, SaysWhatIsLostAndWhyNoneComes) {
  const auto camera = std::make_shared<Waiting>();
  FisheyeReader reader(camera, 0);
  camera->items = {fisheye_frame(2, 0), LostFrame{{33'000'000, 0, 3}, Stream::fisheye, "torn"}};
  EXPECT_EQ(next(reader),
            (Lines{"2", "2 fish-eye pictures missing before picture 2", "fish-eye picture 3 lost: torn"}));
  camera->items = {fisheye_frame(4, 10)};
  EXPECT_EQ(next(reader), (Lines{"", "fish-eye picture 4 is 23 ms older than the one before: dropped"}));
  camera->items = {fisheye_frame(5, 66)};
  camera->warning = "it sends another exposure";
  EXPECT_EQ(next(reader), (Lines{"5", "it sends another exposure"}));
  camera->away = "fish-eye: the camera is disconnected";
  EXPECT_EQ(reader.fault(), camera->away);
}

TEST(FisheyeReader, ReadsLiveCamerasAlone) {
  PairedSources sources;
  sources.fisheye = std::make_shared<Waiting>();
  EXPECT_FALSE(read_fisheye_apart(sources));
  EXPECT_TRUE(sources.fisheye) << "a recording's stays with the others";
  sources.live = true;
  EXPECT_TRUE(read_fisheye_apart(sources));
  EXPECT_FALSE(sources.fisheye);
  EXPECT_FALSE(read_fisheye_apart(sources)) << "there is none";
}

}  // namespace
}  // namespace lumigraft::capture
