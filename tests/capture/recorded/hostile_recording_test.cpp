// Damaged and forged recordings cause a clear error or a shorter session, never a crash, a hang or large memory use.
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <fstream>

#include "capture/error.h"
#include "capture/record/stream_recorder.h"
#include "capture/recorded/mkv_source.h"
#include "tests/capture/recorded/mkv_writer.h"
#include "tests/capture/scratch_folder.h"

namespace lumigraft::capture {
namespace {

using namespace std::chrono_literals;
constexpr int kRecordedWidth = 48;
constexpr int kRecordedHeight = 32;

struct Random {
  std::uint32_t state;
  std::uint32_t operator()() { return (state = state * 1664525u + 1013904223u) >> 8; }
};

class HostileRecording : public test::ScratchFolder {
 protected:
  struct File {
    StreamSpec spec;
    std::string bytes;
  };

  static std::string read(const std::filesystem::path& file) {
    std::ifstream in(file, std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }

  /// One recording of each format that the recorder or other programs write.
  std::vector<File> recordings() const {
    const StreamSpec color{.stream = Stream::color, .width = kRecordedWidth, .height = kRecordedHeight};
    const StreamSpec depth{.stream = Stream::depth, .width = kRecordedWidth, .height = kRecordedHeight};
    {
      StreamRecorder rgb(folder_ / "rgb.mkv", color), bayer(folder_ / "bayer.mkv", color),
          counts(folder_ / "depth.mkv", depth);
      Random random{7};
      for (int i = 0; i < 4; ++i) {
        Frame picture;
        picture.stamp.time_ns = 1 + i * std::int64_t{33'333'333};
        picture.exposure = i == 2 ? 0.5 : 1.0;
        picture.encoded = Image<std::uint8_t>(kRecordedWidth, kRecordedHeight, 3);
        for (std::uint8_t& value : picture.encoded.data) {
          value = static_cast<std::uint8_t>(random());
        }
        rgb.write(picture);
        picture.original = std::make_shared<RawFrame>(
            RawFrame{PixelFormat::bayer_rggb8, std::vector<std::uint8_t>(kRecordedWidth * kRecordedHeight, 9)});
        bayer.write(picture);
        RawDepth raw{picture.stamp, Image<std::uint16_t>(kRecordedWidth, kRecordedHeight, 1)};
        for (std::uint16_t& value : raw.counts.data) {
          value = static_cast<std::uint16_t>(random());
        }
        counts.write(raw);
      }
    }
    const Image<std::uint8_t> grey(kRecordedWidth, kRecordedHeight, 3, 90);
    test::write_color_mkv(folder_ / "jpeg.mkv", "mjpeg", {{0, grey}, {33, grey}, {67, grey}});
    test::write_color_mkv(folder_ / "ffv1.mkv", "ffv1", {{0, grey}, {33, grey}, {67, grey}});
    return {{color, read(folder_ / "rgb.mkv")},
            {color, read(folder_ / "bayer.mkv")},
            {depth, read(folder_ / "depth.mkv")},
            {color, read(folder_ / "jpeg.mkv")},
            {color, read(folder_ / "ffv1.mkv")}};
  }

  /// Applies `damage` to each recording `trials` times and plays it in a child process with limited memory and time.
  template <typename Damage>
  void survive(int trials, const Damage& damage) const {
    const std::vector<File> files = recordings();
    const pid_t child = fork();
    ASSERT_GE(child, 0);
    if (child == 0) {
      const rlimit no_core{0, 0};
      setrlimit(RLIMIT_CORE, &no_core);
      for (int trial = 0; trial < trials; ++trial) {
        for (std::size_t i = 0; i < files.size(); ++i) {
          constexpr unsigned kLongest_s = 20;
          alarm(kLongest_s);
          Random random{static_cast<std::uint32_t>(trial * 16 + static_cast<int>(i) + 1)};
          std::string bytes = files[i].bytes;
          damage(bytes, random);
          const auto file = folder_ / "damaged.mkv";
          std::ofstream(file, std::ios::binary) << bytes;
          try {
            MkvSource source(file, files[i].spec);
            if (trial % 2 == 1) {
              source.skip_to(source.first_time_ns() + 60'000'000);
            }
            for (int picture = 0; picture < 50 && source.next(0ms); ++picture) {
            }
          } catch (const InputError& e) {
            if (std::string(e.what()).find('\n') != std::string::npos) {
              _exit(3);
            }
          }
        }
      }
      rusage use{};
      getrusage(RUSAGE_SELF, &use);
      constexpr long kMax_kb = 700'000;
      _exit(use.ru_maxrss < kMax_kb ? 0 : 4);
    }
    int status = 0;
    waitpid(child, &status, 0);
    EXPECT_TRUE(WIFEXITED(status)) << "signal " << WTERMSIG(status) << "; the file is kept: " << keep();
    EXPECT_EQ(WEXITSTATUS(status), 0) << "3: an error of several lines, 4: too much memory";
  }

  std::string keep() const {
    const auto copy = std::filesystem::temp_directory_path() / "lumigraft_hostile.mkv";
    std::filesystem::copy_file(folder_ / "damaged.mkv", copy, std::filesystem::copy_options::overwrite_existing);
    return copy.string();
  }
};

TEST_F(HostileRecording, FlippedBits) {
  survive(60, [](std::string& bytes, Random& random) {
    const std::size_t range = random() % 2 == 0 ? std::min<std::size_t>(bytes.size(), 500) : bytes.size();
    for (std::uint32_t flips = 1 + random() % 6; flips > 0; --flips) {
      bytes[random() % range] ^= static_cast<char>(1u << (random() % 8));
    }
  });
}

TEST_F(HostileRecording, HugeSizes) {
  // Overwrites eight bytes anywhere, among them sizes, by a huge or by a negative number.
  survive(60, [](std::string& bytes, Random& random) {
    const std::size_t at = random() % std::min<std::size_t>(bytes.size() - 8, 700);
    const std::string huge =
        random() % 2 == 0 ? std::string("\x01\x00\x7F\xFF\xFF\xFF\xFF\xFF", 8) : std::string(8, '\xFF');
    bytes.replace(at, 8, huge);
  });
}

TEST_F(HostileRecording, PiecesMissingRepeatedOrCut) {
  survive(60, [](std::string& bytes, Random& random) {
    const std::size_t from = random() % bytes.size();
    const std::size_t length = random() % (bytes.size() - from);
    switch (random() % 3) {
      case 0:
        bytes.erase(from, length);
        break;
      case 1:
        bytes.insert(random() % bytes.size(), bytes.substr(from, length));
        break;
      default:
        bytes.resize(from);
    }
  });
}

}  // namespace
}  // namespace lumigraft::capture
