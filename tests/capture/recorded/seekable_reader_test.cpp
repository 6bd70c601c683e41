// A recording read from a given time on gives the same frames as a replay from its beginning.
#include "capture/recorded/seekable_reader.h"

#include <gtest/gtest.h>

#include <fstream>

#include "capture/error.h"
#include "capture/record/session_recorder.h"
#include "capture/recorded/mkv_source.h"
#include "capture/sync/pairing_reader.h"
#include "tests/capture/formats/png_writer.h"
#include "tests/capture/scratch_folder.h"

namespace lumigraft::capture {
namespace {

using namespace std::chrono_literals;
constexpr int kPictures = 150;

class SeekableReaderTest : public test::ScratchFolder {
 protected:
  void SetUp() override {
    ScratchFolder::SetUp();
    for (int i = 0; i < 3; ++i) {
      test::write_png(folder_ / ("c" + std::to_string(i) + ".png"),
                      Image<std::uint8_t>(8, 6, 3, static_cast<std::uint8_t>(50 * i)));
      test::write_png(folder_ / ("d" + std::to_string(i) + ".png"),
                      Image<std::uint16_t>(8, 6, 1, static_cast<std::uint16_t>(900 + i)));
    }
    std::ofstream color(folder_ / "color.txt"), depth(folder_ / "depth.txt");
    for (int i = 0; i < kPictures; ++i) {
      const std::string second = std::to_string(7 + i / 30) + "." + std::to_string(1000 + 33 * (i % 30)).substr(1);
      color << second << (i % 40 == 39 ? "7" : "1") << " c" << i % 3 << ".png\n";  // one frame in forty is late
      if (i % 17 != 3) {
        depth << second << "4 d" << i % 3 << ".png\n";
      }
    }
    std::ofstream(folder_ / "session.toml") << "format = 1\n[color]\nsource = \"images:color.txt\"\nwidth = 8\n"
                                            << "height = 6\nfx = 8\nfy = 8\ncx = 4\ncy = 3\nexposure = 1\n[depth]\n"
                                            << "source = \"images:depth.txt\"\nunit_m = 0.001\n[tag]\nid = 1\n"
                                            << "size_m = 0.1\n";
  }
  static Session session(const std::filesystem::path& folder) {
    return read_session(ConfigTable::load(folder / "session.toml"));
  }
  void record() const {
    const Session from = session(folder_);
    const PairedSources sources = open_sources(from);
    SessionRecorder recorder({folder_ / "session.toml", {}}, from, folder_ / "mkv");
    while (const auto item = sources.color->next(0ms)) recorder.write(Stream::color, *item);
    while (const auto item = sources.depth->next(0ms)) recorder.write(Stream::depth, *item);
  }
  static std::vector<std::string> play(FrameReader& reader, std::int64_t from_ns = 0) {
    std::vector<std::string> out;
    std::int64_t first_ns = -1;
    while (const auto set = reader.next(0ms)) {
      first_ns = first_ns < 0 ? set->time_ns : first_ns;
      if (set->time_ns - first_ns < from_ns) {
        continue;
      }
      std::string line = std::to_string(set->index) + " " + std::to_string(set->time_ns) + " " +
                         std::to_string(set->color->encoded.data[0]) + " " +
                         (set->raw_depth ? std::to_string(set->raw_depth->counts.data[0]) : "none");
      for (const std::string& warning : set->warnings) line += " " + warning;
      out.push_back(line);
    }
    EXPECT_TRUE(reader.finished());
    return out;
  }
};

TEST_F(SeekableReaderTest, EqualsAReplayFromTheBeginning) {
  record();
  for (const auto& folder : {folder_, folder_ / "mkv"}) {
    const auto complete = open_frames(session(folder));
    for (const std::int64_t from_ms : {0, 1, 33, 2500, 3999, 4990}) {
      complete->rewind();
      const auto wanted = play(*complete, from_ms * 1'000'000);
      const auto reader = open_frames_from(session(folder), from_ms * 1'000'000);
      EXPECT_EQ(play(*reader), wanted) << from_ms << " ms of " << folder;
      reader->rewind();
      EXPECT_EQ(play(*reader), wanted) << "after rewind()";
      EXPECT_FALSE(reader->live());
    }
    EXPECT_TRUE(play(*open_frames_from(session(folder), 60'000'000'000)).empty()) << "beyond the end";
  }
}

TEST_F(SeekableReaderTest, SeeksBothWaysAndReportsItsLength) {
  record();
  for (const auto& folder : {folder_, folder_ / "mkv"}) {
    const auto complete = play(*open_frames(session(folder)));
    const auto reader = seekable_frames(open_sources(session(folder)));
    ASSERT_TRUE(reader->length_ns());
    const auto newest = [&] {
      const auto set = reader->next(0ms);
      return set ? set->time_ns : -1;
    };
    const std::int64_t first_ns = newest();
    for (const std::int64_t at_ms : {3000, 20, 4100, 0}) {
      reader->seek(at_ms * 1'000'000);
      const std::int64_t time_ns = newest() - first_ns;
      EXPECT_GE(time_ns, at_ms * 1'000'000);
      EXPECT_LT(time_ns, (at_ms + 40) * 1'000'000);
    }
    reader->seek(*reader->length_ns());
    EXPECT_EQ(newest(), first_ns + *reader->length_ns()) << folder;
    EXPECT_EQ(newest(), -1) << "no frame follows the last one";
    reader->seek(0);
    EXPECT_EQ(play(*reader), complete);
  }
}

/// Bytes that this process has read from files.
std::uint64_t bytes_read() {
  std::ifstream in("/proc/self/io");
  std::string word;
  std::uint64_t bytes = 0;
  in >> word >> bytes;
  return bytes;
}

TEST_F(SeekableReaderTest, ReadsLittleOfALargeFile) {
  constexpr int kMany = 300, kAt = 250;
  const StreamSpec spec{.stream = Stream::fisheye, .width = 320, .height = 240};
  const auto file = folder_ / "large.mkv";
  const auto time_ns = [](int i) { return 5 + std::int64_t{33'333'333} * i; };
  {
    StreamRecorder recorder(file, spec);
    for (int i = 0; i < kMany; ++i) {
      Frame picture;
      picture.stamp.time_ns = time_ns(i);
      picture.exposure = 1.0 + i % 2;
      picture.original = std::make_shared<RawFrame>(
          RawFrame{PixelFormat::bayer_rggb8, std::vector<std::uint8_t>(320 * 240, static_cast<std::uint8_t>(i % 250))});
      picture.encoded = Image<std::uint8_t>(320, 240, 3);
      recorder.write(picture);
    }
  }
  MkvSource source(file, spec);
  const std::uint64_t before = bytes_read();
  source.skip_to(time_ns(kAt));
  const auto item = source.next(0ms);
  EXPECT_LT(bytes_read() - before, std::filesystem::file_size(file) / 4)
      << "only element headers and the wanted frames are read";
  ASSERT_TRUE(item);
  const auto& picture = std::get<Frame>(*item);
  EXPECT_EQ(picture.stamp.time_ns, time_ns(kAt));
  EXPECT_EQ(picture.stamp.sequence, std::uint64_t{kAt});
  EXPECT_EQ(picture.exposure, 1.0);
  EXPECT_EQ(picture.original->bytes[0], kAt % 250);
  int behind = 0;
  while (source.next(0ms)) ++behind;
  EXPECT_EQ(behind, kMany - kAt - 1);
}

TEST_F(SeekableReaderTest, IgnoresDamageBeforeTheSeekTime) {
  std::ofstream(folder_ / "c0.png") << "no longer a picture";
  EXPECT_THROW(open_frames_from(session(folder_), 3'000'000'000), InputError)
      << "the first image is checked as in a replay";
}

TEST_F(SeekableReaderTest, LiveCamerasAreRefused) {
  Session live = session(folder_);
  live.color.source = "v4l2:/dev/null/none";
  live.depth.reset();
  EXPECT_THROW(open_frames_from(live, 1), InputError);
}

}  // namespace
}  // namespace lumigraft::capture
