// A recording replays with the same frames and times, also if it was interrupted.
#include "capture/record/session_recorder.h"

#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <fstream>

#include "capture/error.h"
#include "capture/recorded/mkv_source.h"
#include "capture/session/config.h"
#include "capture/sync/pairing_reader.h"
#include "tests/capture/scratch_folder.h"

namespace lumigraft::capture {
namespace {

using namespace std::chrono_literals;

constexpr int kWidth = 61;  // odd, and no multiple of a SIMD width
constexpr int kHeight = 47;

constexpr const char* kSession = R"(format = 1
name = "made up"
about = "for a test"
[color]
source = "openni2:"
width = 61
height = 47
fx = 50.123456789012345
fy = 50
cx = 30
cy = 23
exposure = 2.0
response = "curve.txt"
[depth]
source = "openni2:"
unit_m = 0.001
[fisheye]
source = "openni2:other"
width = 61
height = 47
f = 6
cx = 30
cy = 23
fov_degrees = 180
exposure = 6.0
T_tag_fisheye = [[0.6, 0.8, 0, 0.1], [-0.8, 0.6, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]
[tag]
id = 1
size_m = 0.1
[[real_surface]]
mesh = "floor.ply"
roughness = 0.2
metallic = 1
specular = 1
base_color = [0.5, 0.5, 0.5]
[[lamp]]
tag_id = 4
tag_size_m = 0.05
position_m = [0, 0.1, 0]
radius_m = 0.02
[server]
listen = "127.0.0.1:8080"
)";

/// Times that are not whole microseconds.
std::int64_t time_of(int index, Stream stream) {
  return 86'400'000'000'001 + index * std::int64_t{33'333'333} + static_cast<int>(stream) * std::int64_t{1'000'007};
}

SourceItem item_of(int index, Stream stream, std::optional<double> exposure = std::nullopt) {
  const Stamp stamp{time_of(index, stream), 0, static_cast<std::uint64_t>(index)};
  unsigned random = static_cast<unsigned>(1 + 3 * index + static_cast<int>(stream));
  const auto next = [&random] { return (random = random * 1664525u + 1013904223u) >> 16; };
  if (stream == Stream::depth) {
    RawDepth depth{stamp, Image<std::uint16_t>(kWidth, kHeight, 1)};
    for (std::uint16_t& value : depth.counts.data) {
      value = static_cast<std::uint16_t>(next());
    }
    return depth;
  }
  Frame picture;
  picture.stamp = stamp;
  picture.stream = stream;
  picture.exposure = exposure.value_or(stream == Stream::color ? 2.0 : 6.0);
  picture.encoded = Image<std::uint8_t>(kWidth, kHeight, 3);
  for (std::uint8_t& value : picture.encoded.data) {
    value = static_cast<std::uint8_t>(next());
  }
  return picture;
}

/// Expects frame `index` with identical bytes and time.
void expect_same(const SourceItem& replayed, int index, Stream stream) {
  const SourceItem recorded = item_of(index, stream);
  if (stream == Stream::depth) {
    const auto* depth = std::get_if<RawDepth>(&replayed);
    ASSERT_NE(depth, nullptr);
    EXPECT_EQ(depth->stamp.time_ns, time_of(index, stream));
    EXPECT_EQ(depth->counts.data, std::get<RawDepth>(recorded).counts.data);
    return;
  }
  const auto* picture = std::get_if<Frame>(&replayed);
  ASSERT_NE(picture, nullptr);
  EXPECT_EQ(picture->stamp.time_ns, time_of(index, stream));
  EXPECT_EQ(picture->encoded.data, std::get<Frame>(recorded).encoded.data);
}

class SessionRecording : public test::ScratchFolder {
 protected:
  void SetUp() override {
    ScratchFolder::SetUp();
    std::ofstream(folder_ / "kiosk.toml") << kSession;
    std::ofstream curve(folder_ / "curve.txt");
    for (int i = 0; i < 256; ++i) {
      curve << i / 255.0 << '\n';
    }
    std::ofstream(folder_ / "floor.ply") << "ply\n";
  }
  std::filesystem::path out() const { return folder_ / "out"; }
  SessionText text() const { return {folder_ / "kiosk.toml", {"tag.id=7"}}; }
  Session session() const { return read_session(ConfigTable::load(text().file, text().overrides)); }
  Session replayed() const {
    const ConfigTable root = ConfigTable::load(out() / "session.toml");
    Session read = read_session(root);
    root.finish();
    return read;
  }
  void record(int pictures) const {
    SessionRecorder recorder(text(), session(), out());
    for (int i = 0; i < pictures; ++i) {
      for (const Stream stream : {Stream::color, Stream::depth, Stream::fisheye}) {
        EXPECT_TRUE(recorder.write(stream, item_of(i, stream)));
      }
    }
  }
  /// Replays and checks every frame; returns the number of frames of each stream.
  std::array<int, 3> play() const {
    const PairedSources sources = open_sources(replayed());
    std::array<int, 3> count{};
    for (const Stream stream : {Stream::color, Stream::depth, Stream::fisheye}) {
      Source* source = (stream == Stream::color   ? sources.color
                        : stream == Stream::depth ? sources.depth
                                                  : sources.fisheye)
                           .get();
      while (source != nullptr) {
        const auto item = source->next(0ms);
        if (!item) {
          break;
        }
        expect_same(*item, count[static_cast<std::size_t>(stream)]++, stream);
      }
    }
    return count;
  }
};

TEST_F(SessionRecording, ReplaysByteForByteAndToTheNanosecond) {
  record(5);
  EXPECT_EQ(play(), (std::array{5, 5, 5}));
}

TEST_F(SessionRecording, KeepsTheCalibrationWithoutRounding) {
  record(1);
  const Session before = session();
  const Session after = replayed();
  EXPECT_EQ(after.name, "made up");
  EXPECT_EQ(after.color.source, "mkv:color.mkv");
  EXPECT_EQ(after.color.model.fx, before.color.model.fx);
  EXPECT_EQ(after.color.response.to_linear(77), before.color.response.to_linear(77));
  EXPECT_EQ(after.depth->unit_m, before.depth->unit_m);
  EXPECT_EQ(after.fisheye->model.fov_rad, before.fisheye->model.fov_rad);
  EXPECT_EQ(after.fisheye->T_tag_fisheye.matrix(), before.fisheye->T_tag_fisheye.matrix());
  EXPECT_EQ(after.tag.id, 7) << "set by --set";
  ASSERT_EQ(after.lamps.size(), 1u);
  EXPECT_EQ(after.lamps[0].tag_id, 4);
  ASSERT_EQ(after.real_surfaces.size(), 1u);
  EXPECT_EQ(after.real_surfaces[0].mesh.parent_path(), out());
}

TEST_F(SessionRecording, IncludesALensFromACalibrationFile) {
  std::ofstream(folder_ / "lens.toml") << "format = 1\n[color]\nwidth = 61\nheight = 47\nserial = \"17\"\n"
                                          "fx = 51.25\nfy = 50\ncx = 30\ncy = 23\n";
  const std::filesystem::path file = text().file;
  std::string words = kSession;
  const std::string own = "fx = 50.123456789012345\nfy = 50\ncx = 30\ncy = 23\n";
  words.erase(words.find(own), own.size());
  std::ofstream(file) << "calibration = \"lens.toml\"\n" << words;
  record(1);
  EXPECT_EQ(replayed().color.model.fx, 51.25);
  EXPECT_EQ(replayed().color.serial, "17");
  EXPECT_FALSE(std::filesystem::exists(out() / "lens.toml"));
}

TEST_F(SessionRecording, IncludesTheCompleteCalibration) {
  std::ofstream(folder_ / "rig.toml") << R"(format = 1
[depth]
width = 61
height = 47
T_color_depth = [[1, 0, 0, 0.025], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]
[fisheye]
width = 61
height = 47
f = 6.5
cx = 30
cy = 23
fov_degrees = 180
vignetting = [-0.25, 0.01, -0.02]
time_offset_s = 0.0125
)";
  const std::filesystem::path file = text().file;
  std::string words = kSession;
  const auto replace = [&](const std::string& piece, const std::string& by) {
    ASSERT_NE(words.find(piece), std::string::npos);
    words.replace(words.find(piece), piece.size(), by);
  };
  replace("unit_m = 0.001\n", "unit_m = 0.001\nregistered = false\nfx = 48\nfy = 48\ncx = 30\ncy = 23\n");
  replace("f = 6\ncx = 30\ncy = 23\nfov_degrees = 180\n", "");
  std::ofstream(file) << "calibration = \"rig.toml\"\n" << words;
  record(1);
  const Session after = replayed();
  EXPECT_EQ(after.depth->T_color_depth.translation().x(), 0.025);
  EXPECT_FALSE(after.depth->registered);
  EXPECT_EQ(after.fisheye->model.fx, 6.5);
  EXPECT_EQ(after.fisheye->vignetting.terms[0], -0.25);
  EXPECT_EQ(after.fisheye->time_offset_s, 0.0125);
  // Recorded times are the camera's: the offset is added only when they are read.
  const PairedSources sources = open_sources(after);
  EXPECT_EQ(stamp_of(*sources.fisheye->next(0ms)).time_ns, time_of(0, Stream::fisheye));
}

TEST_F(SessionRecording, AStreamWithoutFramesIsOmitted) {
  SessionRecorder recorder(text(), session(), out());
  recorder.write(Stream::depth, item_of(0, Stream::depth));
  EXPECT_FALSE(std::filesystem::exists(out() / "session.toml"));
  recorder.write(Stream::color, item_of(0, Stream::color));
  EXPECT_EQ(play(), (std::array{1, 1, 0}));
  recorder.write(Stream::fisheye, item_of(0, Stream::fisheye));
  EXPECT_EQ(play(), (std::array{1, 1, 1}));
}

TEST_F(SessionRecording, KeepsTheReadoutTimeThatTheCameraReports) {
  SessionRecorder recorder(text(), session(), out());
  SourceItem item = item_of(0, Stream::color);
  std::get<Frame>(item).readout_s = 0.0185;
  recorder.write(Stream::color, item);
  EXPECT_DOUBLE_EQ(replayed().color.readout_s.value_or(0), 0.0185);
}

TEST_F(SessionRecording, KeepsValidFramesAndTheirExposures) {
  SessionRecorder recorder(text(), session(), out());
  EXPECT_TRUE(recorder.write(Stream::color, item_of(3, Stream::color)));
  EXPECT_FALSE(recorder.write(Stream::color, item_of(3, Stream::color))) << "its time does not increase";
  EXPECT_FALSE(recorder.write(Stream::color, item_of(2, Stream::color)));
  EXPECT_FALSE(recorder.write(Stream::color, LostFrame{{time_of(4, Stream::color), 0, 4}, Stream::color, "torn"}));
  // A bracket: one time, three exposures.
  const std::vector<double> bracket = {6.0, 0.1, 60.00000000000001};
  for (const double exposure : bracket) {
    EXPECT_TRUE(recorder.write(Stream::fisheye, item_of(3, Stream::fisheye, exposure)));
  }
  const PairedSources sources = open_sources(replayed());
  const auto color = sources.color->next(0ms);
  ASSERT_TRUE(color);
  expect_same(*color, 3, Stream::color);
  EXPECT_FALSE(sources.color->next(0ms)) << "one frame was recorded";
  for (const double exposure : bracket) {
    const auto item = sources.fisheye->next(0ms);
    ASSERT_TRUE(item);
    expect_same(*item, 3, Stream::fisheye);
    EXPECT_EQ(std::get<Frame>(*item).exposure, exposure);
  }
  Frame radiance;
  radiance.radiance = Image<float>(kWidth, kHeight, 3);
  EXPECT_THROW(recorder.write(Stream::color, radiance), InputError);
}

TEST_F(SessionRecording, NeverOverwritesARecording) {
  record(1);
  EXPECT_THROW(SessionRecorder(text(), session(), out()), InputError);
  EXPECT_THROW(SessionRecorder(text(), session(), text().file), InputError);
  EXPECT_EQ(play(), (std::array{1, 1, 1}));
}

TEST_F(SessionRecording, DepthMayBeCompressedAfterwards) {
  const auto file = out() / "depth.mkv";
  const auto coded_as = [&](const char* codec) {
    std::ifstream in(file, std::ios::binary);
    return std::string((std::istreambuf_iterator<char>(in)), {}).find(codec) != std::string::npos;
  };
  SessionRecorder recorder(text(), session(), out(), DepthCoding::uncompressed);
  for (int i = 0; i < 4; ++i) {
    for (const Stream stream : {Stream::color, Stream::depth}) {
      recorder.write(stream, item_of(i, stream));
    }
  }
  EXPECT_EQ(play(), (std::array{4, 4, 0})) << "uncompressed";
  EXPECT_TRUE(coded_as("V_UNCOMPRESSED"));
  std::filesystem::resize_file(file, std::filesystem::file_size(file) - 1);  // as after a killed recorder
  std::stop_source stopped;
  stopped.request_stop();
  recorder.compress_depth(stopped.get_token());
  EXPECT_TRUE(coded_as("V_UNCOMPRESSED")) << "a stopped compression changes nothing";
  recorder.compress_depth({});
  EXPECT_TRUE(coded_as("V_FFV1"));
  EXPECT_EQ(play(), (std::array{4, 3, 0})) << "the incomplete frame is lost with and without compression";
  EXPECT_FALSE(std::filesystem::exists(out() / "depth.mkv.partial"));
}

TEST_F(SessionRecording, CutAtAnyByteItReplaysToTheLastCompleteFrame) {
  record(3);
  for (const Stream stream : {Stream::color, Stream::depth}) {
    const auto file = out() / (stream == Stream::color ? "color.mkv" : "depth.mkv");
    const StreamSpec spec{.stream = stream, .width = kWidth, .height = kHeight};
    std::ifstream in(file, std::ios::binary);
    const std::string complete((std::istreambuf_iterator<char>(in)), {});
    const std::string cluster = "\x1F\x43\xB6\x75";
    std::vector<std::size_t> ends;  // file positions after complete frames
    for (std::size_t next = complete.find(cluster, complete.find(cluster) + 1); next != std::string::npos;
         next = complete.find(cluster, next + 1)) {
      ends.push_back(next);
    }
    ends.push_back(complete.size());
    ASSERT_EQ(ends.size(), 3u);
    const auto cut = folder_ / "cut.mkv";
    const auto check = [&](std::size_t length) {
      std::ofstream(cut, std::ios::binary) << complete.substr(0, length);
      const auto expected = std::count_if(ends.begin(), ends.end(), [&](std::size_t end) { return end <= length; });
      int shown = 0;
      try {
        MkvSource source(cut, spec);
        while (const auto item = source.next(0ms)) {
          if (!std::holds_alternative<LostFrame>(*item)) {
            expect_same(*item, shown++, stream);
          }
        }
      } catch (const InputError&) {
      }
      EXPECT_EQ(shown, expected) << length << " of " << complete.size();
    };
    for (std::size_t length = 0; length < ends[0]; length += length < 600 ? 1 : 97) {
      check(length);
    }
    for (const std::size_t end : ends) {
      for (std::size_t length = end - 3; length < end + 60 && length <= complete.size(); ++length) {
        check(length);
      }
    }
    for (std::size_t length = ends[0]; length < complete.size(); length += 211) {
      check(length);
    }
  }
}

TEST_F(SessionRecording, AKilledRecorderLeavesAValidSession) {
  int pipe_ends[2];
  ASSERT_EQ(pipe(pipe_ends), 0);
  const pid_t child = fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    SessionRecorder recorder(text(), session(), out());
    for (int i = 0;; ++i) {
      for (const Stream stream : {Stream::color, Stream::depth, Stream::fisheye}) {
        recorder.write(stream, item_of(i, stream));
      }
      const char one = 1;
      if (write(pipe_ends[1], &one, 1) != 1) {
        _exit(1);
      }
    }
  }
  char ignored[8];
  for (int i = 0; i < 8; ++i) {
    ASSERT_EQ(read(pipe_ends[0], ignored, 1), 1);
  }
  kill(child, SIGKILL);
  int status = 0;
  waitpid(child, &status, 0);
  EXPECT_TRUE(WIFSIGNALED(status));
  close(pipe_ends[0]);
  close(pipe_ends[1]);
  const std::array<int, 3> count = play();
  EXPECT_GE(count[0], 8);
  EXPECT_GE(count[1], 8);
  EXPECT_GE(count[2], 8);
  EXPECT_LE(count[0] - count[2], 1);
}

TEST_F(SessionRecording, AFullDiskKeepsTheFramesWritten) {
  const pid_t child = fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    // A limit on file size replaces a disk that becomes full within a frame.
    std::signal(SIGXFSZ, SIG_IGN);
    SessionRecorder recorder(text(), session(), out());
    const rlimit limit{30'000, 30'000};
    setrlimit(RLIMIT_FSIZE, &limit);
    try {
      for (int i = 0;; ++i) {
        recorder.write(Stream::depth, item_of(i, Stream::depth));
        recorder.write(Stream::color, item_of(i, Stream::color));
      }
    } catch (const std::runtime_error& e) {
      _exit(std::string(e.what()).find("mkv: File too large") != std::string::npos ? 0 : 1);
    }
  }
  int status = 0;
  waitpid(child, &status, 0);
  EXPECT_EQ(status, 0);
  const std::array<int, 3> count = play();
  EXPECT_EQ(count[0], 3) << "three frames of 8,601 bytes fit";
  EXPECT_EQ(count[1], 3) << "FFV1 makes noise slightly larger";
  for (const char* file : {"color.mkv", "depth.mkv"}) {
    EXPECT_LT(std::filesystem::file_size(out() / file), 30'000u) << "the incomplete frame is removed";
  }
}

}  // namespace
}  // namespace lumigraft::capture
