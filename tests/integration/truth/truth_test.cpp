// Scores composited pictures against path-traced truth: prints a table, and checks recorded bounds.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include "capture/camera/srgb.h"
#include "capture/formats/picture_file.h"
#include "capture/formats/picture_writer.h"
#include "capture/session/config.h"
#include "capture/session/session.h"
#include "server/bench/measures.h"
#include "server/pipeline/service_config.h"

namespace lumigraft::test {
namespace {

namespace fs = std::filesystem;

std::vector<std::string> color_list(const fs::path& session) {
  std::vector<std::string> paths;
  std::ifstream list(session / "color.txt");
  for (std::string line; std::getline(list, line);) {
    std::istringstream words(line);
    std::string time, path;
    if (words >> time >> path && time[0] != '#') {
      paths.push_back(path);
    }
  }
  return paths;
}

/// What a colour camera does to light without the session saying so: linear gain of a pixel, per channel.
struct ColorDefect {
  std::array<float, 3> gain = {1, 1, 1};
  float corner_loss = 0;

  bool none() const { return gain == std::array<float, 3>{1, 1, 1} && corner_loss == 0; }
  float at(int u, int v, int c, int width, int height) const {
    const float x = static_cast<float>(2 * u - width + 1), y = static_cast<float>(2 * v - height + 1);
    const auto square = static_cast<float>(width * width + height * height);
    return gain[static_cast<std::size_t>(c)] * (1 - corner_loss * (x * x + y * y) / square);
  }
};

/// A session as seen by a camera with the defect, in the folder `to`.
void write_defective(const fs::path& session, const ColorDefect& defect, const fs::path& to) {
  fs::create_directories(to);
  for (const auto& entry : fs::directory_iterator(session))
    if (entry.path().filename() != "color")
      fs::create_symlink(fs::absolute(entry.path()), to / entry.path().filename());
  for (const std::string& color : color_list(session)) {
    capture::Image<std::uint8_t> picture = capture::read_encoded(session / color);
    for (int v = 0; v < picture.height; ++v)
      for (int u = 0; u < picture.width; ++u)
        for (int c = 0; c < 3; ++c) {
          std::uint8_t& code = picture.at(u, v, c);
          code = capture::srgb_table().code(defect.at(u, v, c, picture.width, picture.height) *
                                            capture::srgb_table().linear[code]);
        }
    fs::create_directories((to / color).parent_path());
    capture::write_png(to / color, picture);
  }
}

void apply(const ColorDefect& defect, server::TruePictures& truth) {
  for (capture::Image<float>* image : {&truth.background, &truth.augmented})
    for (int v = 0; v < image->height; ++v)
      for (int u = 0; u < image->width; ++u)
        for (int c = 0; c < 3; ++c) image->at(u, v, c) *= defect.at(u, v, c, image->width, image->height);
}

// Software rendering takes seconds per frame: just enough frames to reconstruct the scene.
constexpr int kStillFrames = 2;
constexpr int kMovingFrames = 8;
constexpr int kConeFrames = 4;       // at full resolution on a software device
constexpr int kChangingFrames = 12;  // lamps that go off and on again

struct SessionScore {
  server::Measures mean;
  double worst_relight_error = 0, worst_object_error = 0;
  double psnr_unchanged_db = 0;  ///< the unchanged camera picture: the baseline
  int frames = 0;
};

/// Replays the first frames of a session with the program and scores every frame that has truth. A static session has
/// truth for its first frame only; then the last replayed frame is scored, when the scene is reconstructed.
SessionScore replay_and_score(fs::path session, const std::string& group, const std::string& options,
                              const ColorDefect& defect) {
  const std::string name = group + "-" + session.filename().string() + "-" + std::to_string(getpid());
  const fs::path out = fs::temp_directory_path() / ("lumigraft-truth-" + name);
  const fs::path seen = out.string() + "-seen";
  fs::remove_all(out);
  const capture::ConfigTable root = capture::ConfigTable::load(session / "session.toml");
  const double exposure = capture::read_session(root).color.exposure;
  const std::vector<std::string> colors = color_list(session);
  std::map<int, fs::path> truths;
  for (const auto& entry : fs::directory_iterator(session / "truth")) {
    if (entry.is_directory()) {
      truths[std::stoi(entry.path().filename().string())] = entry.path();
    }
  }
  const bool still = truths.size() == 1;
  const int frames = std::min(static_cast<int>(colors.size()), still                 ? kStillFrames
                                                               : group == "changing" ? kChangingFrames
                                                               : group == "cones"    ? kConeFrames
                                                                                     : kMovingFrames);
  if (!defect.none()) {
    fs::remove_all(seen);
    write_defective(session, defect, seen);
    session = seen;
  }
  const std::string command = std::string(LUMIGRAFT_PROGRAM) + " replay " + session.string() + " --out " +
                              out.string() + " --frames " + std::to_string(frames) + options + " > /dev/null";
  SessionScore result;
  if (std::system(command.c_str()) != 0) {
    ADD_FAILURE() << command;
    return result;
  }
  for (const auto& [index, truth] : truths) {
    const int frame = still ? frames - 1 : index;
    if (frame >= frames) {
      continue;
    }
    char file[32];
    std::snprintf(file, sizeof file, "frame_%06d.png", frame);
    server::TruePictures wanted = server::read_true_pictures(truth, exposure);
    apply(defect, wanted);
    const capture::Image<std::uint8_t> camera = capture::read_encoded(session / colors[frame]);
    const server::Measures measures = server::measure_picture(capture::read_encoded(out / file), camera, wanted);
    result.worst_relight_error = std::max(result.worst_relight_error, measures.relight_error);
    result.worst_object_error = std::max(result.worst_object_error, measures.object_error);
    result.mean.relight_error += measures.relight_error;
    result.mean.object_error += measures.object_error;
    result.mean.psnr_db += measures.psnr_db;
    result.mean.psnr_affected_db += measures.psnr_affected_db;
    result.mean.flip += measures.flip;
    result.psnr_unchanged_db += server::measure_picture(camera, camera, wanted).psnr_db;
    ++result.frames;
  }
  for (double* sum : {&result.mean.relight_error, &result.mean.object_error, &result.mean.psnr_db,
                      &result.mean.psnr_affected_db, &result.mean.flip, &result.psnr_unchanged_db}) {
    *sum /= result.frames;
  }
  fs::remove_all(out);
  fs::remove_all(seen);
  return result;
}

/// Of a session in bounds.toml: [group.session-name] relight_error = ..., psnr_db = ..., and perhaps object_error and
/// the worst frame's.
std::optional<capture::ConfigTable> bound_of(const fs::path& session, const std::string& group) {
  const capture::ConfigTable bounds =
      capture::ConfigTable::load(fs::path(LUMIGRAFT_SOURCE_DIR) / "tests/integration/truth/bounds.toml");
  return bounds.table(group).optional_table(session.filename().string());
}

/// Scores a session and checks its bound.
void check(const fs::path& session, const std::string& group, const std::string& options = "",
           const ColorDefect& defect = {}) {
  const std::string name = session.filename().string();
  const SessionScore score = replay_and_score(session, group, options, defect);
  ASSERT_GT(score.frames, 0);
  std::printf(
      "TRUTH %-10s %-18s frames %2d  relight_error %.3f  object_error %.3f  worst %.3f %.3f  psnr %.2f dB  affected "
      "%.2f dB  flip %.4f  "
      "(unchanged %.2f dB)\n",
      group.c_str(), name.c_str(), score.frames, score.mean.relight_error, score.mean.object_error,
      score.worst_relight_error, score.worst_object_error, score.mean.psnr_db, score.mean.psnr_affected_db,
      score.mean.flip, score.psnr_unchanged_db);
  if (const auto bound = bound_of(session, group)) {
    EXPECT_LE(score.mean.relight_error, bound->number("relight_error", 0, 10));
    EXPECT_LE(score.mean.object_error, bound->number("object_error", 0, 10, 10));
    EXPECT_LE(score.worst_relight_error, bound->number("worst_relight_error", 0, 10, 10));
    EXPECT_LE(score.worst_object_error, bound->number("worst_object_error", 0, 10, 10));
    EXPECT_GE(score.mean.psnr_db, bound->number("psnr_db", 0, 100));
  }
  EXPECT_GT(score.mean.psnr_db, score.psnr_unchanged_db);
}

/// A copy of a session whose configuration lacks the section of a camera; the data are links.
class WithoutCamera {
 public:
  WithoutCamera(const fs::path& session, const std::string& camera)
      : root_(fs::temp_directory_path() / ("lumigraft-no-" + camera + "-" + std::to_string(getpid()))),
        folder_(root_ / session.filename()) {
    fs::create_directories(folder_);
    for (const auto& entry : fs::directory_iterator(session))
      if (entry.path().filename() != "session.toml")
        fs::create_symlink(fs::canonical(entry.path()), folder_ / entry.path().filename());
    std::ifstream from(session / "session.toml");
    std::ofstream to(folder_ / "session.toml");
    bool left_out = false;
    for (std::string line; std::getline(from, line);) {
      if (line.starts_with("[")) left_out = line.starts_with("[" + camera);
      if (!left_out) to << line << '\n';
    }
  }
  ~WithoutCamera() { fs::remove_all(root_); }
  WithoutCamera(const WithoutCamera&) = delete;
  WithoutCamera& operator=(const WithoutCamera&) = delete;
  const fs::path& folder() const { return folder_; }

 private:
  fs::path root_, folder_;
};

TEST(Truth, OwnRecordings) {
  for (const auto& entry : fs::directory_iterator(fs::path(LUMIGRAFT_SOURCE_DIR) / "recordings")) {
    if (fs::exists(entry.path() / "truth")) {
      check(entry.path(), "recordings");
    }
  }
}

// With serve's default plan.
TEST(Truth, OwnRecordingLive) {
  const relight::Plan live = server::interactive_plan();
  check(fs::path(LUMIGRAFT_SOURCE_DIR) / "recordings/tabletop", "live",
        " --set plan.method=dvct --set plan.trace_scale=" + std::to_string(live.trace_scale) +
            " --set plan.rsm=" + std::to_string(live.rsm));
}

// The fish-eye shows how the colour camera differs from what the session says.
TEST(Truth, OwnRecordingInAnotherWhiteBalance) {
  check(fs::path(LUMIGRAFT_SOURCE_DIR) / "recordings/tabletop", "tinted", "", {.gain = {0.62f, 1, 1.45f}});
}

TEST(Truth, OwnRecordingWithDarkCorners) {
  check(fs::path(LUMIGRAFT_SOURCE_DIR) / "recordings/tabletop", "dark-corners", "", {.corner_loss = 0.5f});
}

// On the GPU device: gain and vignetting are undone by other code.
TEST(Truth, OwnRecordingByConesWithDarkCorners) {
  check(fs::path(LUMIGRAFT_SOURCE_DIR) / "recordings/tabletop", "dark-corners-cones",
        " --set plan.method=dvct --set plan.trace_scale=4", {.gain = {0.8f, 1, 1.25f}, .corner_loss = 0.5f});
}

// On the GPU device.
TEST(Truth, OwnRecordingByCones) {
  check(fs::path(LUMIGRAFT_SOURCE_DIR) / "recordings/tabletop", "cones", " --set plan.method=dvct");
}

// Light from what the colour camera sees.
TEST(Truth, OwnRecordingWithoutFisheye) {
  const WithoutCamera session(fs::path(LUMIGRAFT_SOURCE_DIR) / "recordings/tabletop", "fisheye");
  check(session.folder(), "colour");
}

// On the plane of its tag. Its boxes are not known, so they take no shadow.
TEST(Truth, OwnRecordingWithoutDepth) {
  const WithoutCamera session(fs::path(LUMIGRAFT_SOURCE_DIR) / "recordings/tabletop", "depth");
  check(session.folder(), "flat");
}

/// Sessions of a folder of LUMIGRAFT_EXTRA that have truth; only those with a bound if `bounded`. Without the camera
/// `left_out`.
void check_extra(const std::string& folder, const std::string& group, bool bounded, const std::string& left_out = "") {
  const char* extra = std::getenv("LUMIGRAFT_EXTRA");
  if (extra == nullptr || !fs::exists(fs::path(extra) / folder)) {
    GTEST_SKIP() << "LUMIGRAFT_EXTRA names no folder with " << folder
                 << ": only the project's own recordings are scored";
  }
  std::vector<fs::path> sessions;
  for (const auto& entry : fs::directory_iterator(fs::path(extra) / folder)) {
    const bool wanted = !bounded || bound_of(entry.path(), group);
    if (wanted && fs::exists(entry.path() / "truth")) {
      sessions.push_back(entry.path());
    }
  }
  std::sort(sessions.begin(), sessions.end());
  for (const fs::path& session : sessions) {
    if (left_out.empty())
      check(session, group);
    else
      check(WithoutCamera(session, left_out).folder(), group);
  }
}

TEST(Truth, ExtraSessions) { check_extra("sessions", "extra", false); }

TEST(Truth, ExtraSessionsWithoutFisheye) { check_extra("sessions", "extra_colour", true, "fisheye"); }

TEST(Truth, ExtraSessionsWithoutDepth) { check_extra("sessions", "extra_flat", true, "depth"); }

// Rooms, cameras and lamps that change while they are seen.
TEST(Truth, ExtraChangingSessions) { check_extra("sessions-changing", "changing", true); }

}  // namespace
}  // namespace lumigraft::test
