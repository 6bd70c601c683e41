// Kills `lumigraft record` at arbitrary times: its session can be replayed up to the last complete picture.
#include <gtest/gtest.h>

#include <array>
#include <cstdlib>
#include <fstream>
#include <random>

#include "capture/session/config.h"
#include "capture/sync/pairing_reader.h"
#include "tests/capture/live/gige_camera.h"
#include "tests/capture/live/leaks.h"
#include "tests/capture/live/openni_test_pictures.h"
#include "tests/capture/live/small_camera.h"
#include "tests/capture/scratch_folder.h"
#include "tests/server/commands/program.h"

namespace lumigraft::server {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;
namespace fs = std::filesystem;

/// Number of complete clusters of a Matroska file; each holds a picture.
int complete_frames(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  const std::string bytes((std::istreambuf_iterator<char>(in)), {});
  const std::string id = "\x1F\x43\xB6\x75";
  int count = 0;
  for (std::size_t at = bytes.find(id); at != std::string::npos && at + 12 <= bytes.size(); ++count) {
    if (bytes.compare(at, 4, id) != 0) {
      ADD_FAILURE() << file << ": no cluster at " << at;
      break;
    }
    std::size_t size = 0;
    for (std::size_t i = 5; i < 12; ++i) {
      size = 256 * size + static_cast<unsigned char>(bytes[at + i]);
    }
    at += 12 + size;
    if (at > bytes.size()) {
      break;
    }
    if (at == bytes.size()) {
      return count + 1;
    }
  }
  return count;
}

/// Whether the picture equals one of the device's pictures, byte for byte.
bool is_complete(const capture::SourceItem& item) {
  const auto* color = std::get_if<capture::Frame>(&item);
  const auto* depth = std::get_if<capture::RawDepth>(&item);
  if (color == nullptr && depth == nullptr) {
    return false;
  }
  int index = 0;  // index of the device's picture; they repeat with this period
  constexpr int kPeriod = 25'600;
  const auto fits = [&](int x, int y) {
    return depth != nullptr ? depth->counts.at(x, y) == test::device_depth(index, x, y)
                            : color->encoded.at(x, y, 0) == test::device_color(index, x, y, 0) &&
                                  color->encoded.at(x, y, 1) == test::device_color(index, x, y, 1) &&
                                  color->encoded.at(x, y, 2) == test::device_color(index, x, y, 2);
  };
  while (index < kPeriod && !fits(test::kDeviceWidth - 1, 0)) {
    ++index;
  }
  for (int y = 0; y < test::kDeviceHeight; ++y) {
    for (int x = 0; x < test::kDeviceWidth; ++x) {
      if (!fits(x, y)) {
        return false;
      }
    }
  }
  return true;
}

class KilledRecorder : public test::ScratchFolder {
 protected:
  void SetUp() override {
    ScratchFolder::SetUp();
    setenv("LD_LIBRARY_PATH", LUMIGRAFT_OPENNI_FOLDER, 1);  // for the program: the folder of the test's device driver
    std::ofstream(config()) << "format = 1\n[color]\nsource = \"openni2:\"\n"
                            << test::kSmallCamera
                            << "[depth]\nsource = \"openni2:\"\nunit_m = 0.001\n[tag]\nid = 1\nsize_m = 0.1\n";
  }
  void TearDown() override {
    unsetenv("LD_LIBRARY_PATH");
    ScratchFolder::TearDown();
  }
  fs::path config() const { return folder_ / "kiosk.toml"; }

  /// Number of pictures that can be replayed, by stream. Expects the same number in the files, or one more that the
  /// session's text does not list yet.
  static std::array<int, 2> play(const fs::path& session) {
    std::array<int, 2> count{};
    const std::array<int, 2> complete = {complete_frames(session / "color.mkv"),
                                         complete_frames(session / "depth.mkv")};
    if (!fs::exists(session / "session.toml")) {
      EXPECT_LE(complete[0], 1);
      return count;
    }
    const capture::PairedSources sources =
        capture::open_sources(capture::read_session(capture::ConfigTable::load(session / "session.toml")));
    for (const auto& [source, i] : {std::pair(sources.color, 0), std::pair(sources.depth, 1)}) {
      while (const auto item = source ? source->next(0ms) : std::nullopt) {
        EXPECT_TRUE(is_complete(*item)) << "picture " << count[i];
        ++count[i];
      }
      EXPECT_TRUE(count[i] == complete[i] || (!source && complete[i] <= 1)) << count[i] << " of " << complete[i];
    }
    return count;
  }
};

TEST_F(KilledRecorder, ReplaysToItsLastCompleteFrame) {
  std::mt19937 random(7);
  test::Leaks leaks;
  int sessions = 0, pictures = 0;
  const int cycles = test::cycles(12);
  for (int cycle = 0; cycle < cycles; ++cycle) {
    const fs::path out = folder_ / ("out" + std::to_string(cycle));
    Program program(folder_, {"record", "--config", config(), "--out", out});
    const Clock::time_point begin = Clock::now();
    const bool while_it_starts = cycle % 4 == 0;
    while (!while_it_starts && !fs::exists(out / "session.toml") && Clock::now() - begin < 20s) {
      std::this_thread::sleep_for(1ms);
    }
    std::this_thread::sleep_for(std::chrono::microseconds(random() % 300'000));
    program.signal(SIGKILL);
    EXPECT_EQ(program.wait(), -SIGKILL) << program.stderr_text();
    const std::array<int, 2> replayed = play(out);
    EXPECT_TRUE(while_it_starts || replayed[0] > 0) << program.stderr_text();
    sessions += replayed[0] > 0 ? 1 : 0;
    pictures += replayed[0] + replayed[1];
    fs::remove_all(out);
    ASSERT_FALSE(HasFailure()) << "cycle " << cycle;
    leaks.end_of_cycle();
  }
  leaks.expect_none();
  std::printf("killed %d times: %d sessions, %d pictures\n", cycles, sessions, pictures);
}

/// The camera reserves its control channel for a dead client until the heartbeat timeout, and keeps sending pictures to
/// it. A client that connects at the very end of the timeout, as here after 700 ms on an idle machine, gets a running
/// camera.
TEST_F(KilledRecorder, ItsGigeCameraIsTheNextProgramsSoon) {
  const test::GigeCamera camera;
  ASSERT_TRUE(camera.running());
  std::ofstream(config()) << "format = 1\n[color]\nsource = \"aravis:" << test::GigeCamera::kName << "\"\n"
                          << test::kSmallCamera << "pixel_format = \"grey8\"\n[tag]\nid = 1\nsize_m = 0.1\n";
  Clock::duration start{};
  for (int turn = 0; turn < 2; ++turn) {
    const fs::path out = folder_ / ("out" + std::to_string(turn));
    Program program(folder_, {"record", "--config", config(), "--out", out});
    const Clock::time_point begin = Clock::now();
    while (!fs::exists(out / "session.toml") && Clock::now() - begin < 20s) {
      std::this_thread::sleep_for(10ms);
    }
    const Clock::duration took = Clock::now() - begin;
    start = turn == 0 ? took : start;  // start-up time of the program on this machine
    EXPECT_LT(took, 5s + 3 * start);
    std::this_thread::sleep_for(700ms);
    program.signal(SIGKILL);
    EXPECT_EQ(program.wait(), -SIGKILL) << program.stderr_text();
    EXPECT_EQ(program.stderr_text().find("delivers no frames"), std::string::npos) << program.stderr_text();
    EXPECT_GT(complete_frames(out / "color.mkv"), 0);
  }
}

}  // namespace
}  // namespace lumigraft::server
