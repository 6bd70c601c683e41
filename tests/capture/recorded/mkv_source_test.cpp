#include "capture/recorded/mkv_source.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <functional>

#include "capture/error.h"
#include "tests/capture/recorded/mkv_writer.h"
#include "tests/capture/scratch_folder.h"

namespace lumigraft::capture {
namespace {

using namespace std::chrono_literals;

constexpr int kVideoWidth = 96;
constexpr int kVideoHeight = 64;
const StreamSpec kColorVideo{Stream::color, kVideoWidth, kVideoHeight, 2.5};
const StreamSpec kDepthVideo{Stream::depth, kVideoWidth, kVideoHeight, 1.0};

test::TimedRgb color_at(std::int64_t time_ms) {
  test::TimedRgb out{time_ms, Image<std::uint8_t>(kVideoWidth, kVideoHeight, 3)};
  for (int y = 0; y < kVideoHeight; ++y) {
    for (int x = 0; x < kVideoWidth; ++x) {
      out.rgb.at(x, y, 0) = static_cast<std::uint8_t>(2 * x);
      out.rgb.at(x, y, 1) = static_cast<std::uint8_t>(3 * y);
      out.rgb.at(x, y, 2) = static_cast<std::uint8_t>(100 + time_ms / 4);
    }
  }
  return out;
}

test::TimedCounts depth_at(std::int64_t time_ms) {
  test::TimedCounts out{time_ms, Image<std::uint16_t>(kVideoWidth, kVideoHeight, 1)};
  for (std::size_t i = 0; i < out.counts.data.size(); ++i) {
    out.counts.data[i] = static_cast<std::uint16_t>((i * 2654435761u + static_cast<unsigned>(time_ms)) >> 7);
  }
  return out;
}

class MkvSourceTest : public test::ScratchFolder {
 protected:
  std::filesystem::path file() const { return folder_ / "test.mkv"; }
  void write_color(const std::string& codec) {
    test::write_color_mkv(file(), codec, {color_at(0), color_at(33), color_at(67), color_at(100)});
  }
  void write_depth() { test::write_depth_mkv(file(), {depth_at(0), depth_at(33), depth_at(67), depth_at(100)}); }

  std::string error(const StreamSpec& spec) const {
    try {
      MkvSource source(file(), spec);
    } catch (const InputError& e) {
      EXPECT_EQ(std::string(e.what()).find('\n'), std::string::npos);
      EXPECT_EQ(std::string(e.what()).find(file().string() + ": "), 0u);
      return e.what();
    }
    return "no error";
  }
  void change(const std::function<void(std::string&)>& edit) const {
    std::ifstream in(file(), std::ios::binary);
    std::string bytes((std::istreambuf_iterator<char>(in)), {});
    in.close();
    edit(bytes);
    std::ofstream(file(), std::ios::binary) << bytes;
  }
};

TEST_F(MkvSourceTest, DepthIsBitExact) {
  write_depth();
  MkvSource source(file(), kDepthVideo);
  for (int pass = 0; pass < 2; ++pass) {
    std::uint64_t sequence = 0;
    for (const std::int64_t time_ms : {0, 33, 67, 100}) {
      EXPECT_FALSE(source.finished());
      const auto item = source.next(0ms);
      ASSERT_TRUE(item);
      const auto& depth = std::get<RawDepth>(*item);
      EXPECT_EQ(depth.counts.data, depth_at(time_ms).counts.data);
      EXPECT_EQ(depth.stamp.time_ns, time_ms * 1'000'000);
      EXPECT_EQ(depth.stamp.sequence, sequence++);
    }
    EXPECT_TRUE(source.finished());
    EXPECT_FALSE(source.next(0ms));
    source.rewind();
  }
}

TEST_F(MkvSourceTest, LosslessColorIsBitExact) {
  write_color("ffv1");
  MkvSource source(file(), kColorVideo);
  for (const std::int64_t time_ms : {0, 33, 67, 100}) {
    const auto item = source.next(0ms);
    ASSERT_TRUE(item);
    const auto& picture = std::get<Frame>(*item);
    EXPECT_EQ(picture.encoded.data, color_at(time_ms).rgb.data);
    EXPECT_EQ(picture.exposure, 2.5);
    EXPECT_EQ(picture.stamp.time_ns, time_ms * 1'000'000);
  }
}

TEST_F(MkvSourceTest, MotionJpegIsAccurateAndUnbiased) {
  write_color("mjpeg");
  MkvSource source(file(), kColorVideo);
  for (const std::int64_t time_ms : {0, 33, 67, 100}) {
    const auto item = source.next(0ms);
    ASSERT_TRUE(item);
    const auto& picture = std::get<Frame>(*item);
    const test::TimedRgb truth = color_at(time_ms);
    double sum = 0.0;
    for (std::size_t i = 0; i < truth.rgb.data.size(); ++i) {
      const int error = picture.encoded.data[i] - truth.rgb.data[i];
      ASSERT_LE(std::abs(error), 12) << i;
      sum += error;
    }
    EXPECT_NEAR(sum / static_cast<double>(truth.rgb.data.size()), 0.0, 0.5) << "full range is kept";
  }
}

TEST_F(MkvSourceTest, ATruncatedFilePlaysUpToItsEnd) {
  write_depth();
  change([](std::string& bytes) { bytes.resize(bytes.size() * 6 / 10); });
  MkvSource source(file(), kDepthVideo);
  int pictures = 0;
  while (const auto item = source.next(0ms)) {
    if (const auto* depth = std::get_if<RawDepth>(&*item)) {
      EXPECT_EQ(depth->counts.data, depth_at(depth->stamp.time_ns / 1'000'000).counts.data);
      ++pictures;
    }
  }
  EXPECT_EQ(pictures, 2);
  EXPECT_TRUE(source.finished());
}

TEST_F(MkvSourceTest, ADamagedFrameIsLostAndTheRestPlays) {
  write_depth();
  change([](std::string& bytes) {
    for (std::size_t i = bytes.size() * 55 / 100; i < bytes.size() * 55 / 100 + 40; ++i) {
      bytes[i] = static_cast<char>(bytes[i] ^ 0x5a);
    }
  });
  MkvSource source(file(), kDepthVideo);
  std::string seen;
  while (const auto item = source.next(0ms)) {
    if (const auto* depth = std::get_if<RawDepth>(&*item)) {
      EXPECT_EQ(depth->counts.data, depth_at(depth->stamp.time_ns / 1'000'000).counts.data) << seen.size();
      seen += 'p';
    } else {
      EXPECT_EQ(std::get<LostFrame>(*item).stamp.sequence, seen.size());
      seen += 'x';
    }
  }
  EXPECT_EQ(seen, "ppxp");
}

TEST_F(MkvSourceTest, BadFilesAreRefused) {
  EXPECT_NE(error(kDepthVideo).find("no readable Matroska file"), std::string::npos);
  std::ofstream(file()) << "";
  EXPECT_NE(error(kDepthVideo).find("no readable Matroska file"), std::string::npos);
  std::ofstream(file()) << std::string(5000, 'x');
  EXPECT_NE(error(kDepthVideo).find("no readable Matroska file"), std::string::npos);
  write_depth();
  EXPECT_NE(error({Stream::depth, 640, 480, 1.0}).find("found 96x64 pixels, allowed: 640x480"), std::string::npos);
  EXPECT_NE(error(kColorVideo).find("found pixel format gray16le, allowed: 8 bits a channel"), std::string::npos);
  write_color("mjpeg");
  EXPECT_NE(error(kDepthVideo).find("found codec mjpeg, allowed: ffv1"), std::string::npos);
  write_color("ffv1");
  EXPECT_NE(error(kDepthVideo).find("found pixel format bgr0, allowed: gray16"), std::string::npos);
  write_depth();
  change([](std::string& bytes) { bytes.resize(700); });
  EXPECT_NE(error(kDepthVideo), "no error");
}

TEST_F(MkvSourceTest, FlippedBitsNeverCrash) {
  write_depth();
  std::ifstream in(file(), std::ios::binary);
  const std::string good((std::istreambuf_iterator<char>(in)), {});
  unsigned random = 1;
  for (int trial = 0; trial < 150; ++trial) {
    std::string bytes = good;
    for (int flip = 0; flip < 4; ++flip) {
      random = random * 1664525u + 1013904223u;
      const std::size_t range = trial % 2 == 0 ? 1200 : bytes.size();
      bytes[(random >> 8) % range] ^= static_cast<char>(1 << (random & 7));
    }
    std::ofstream(file(), std::ios::binary) << bytes;
    try {
      MkvSource source(file(), kDepthVideo);
      for (int i = 0; i < 100 && source.next(0ms); ++i) {
      }
    } catch (const InputError&) {
    }
  }
}

}  // namespace
}  // namespace lumigraft::capture
