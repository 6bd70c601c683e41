// Export to TUM's layout and import of it, and import of recordings of the benchmark's cameras.
#include "server/commands/tum.h"

#include <gtest/gtest.h>

#include <cstdlib>
#include <fstream>
#include <sstream>

#include "capture/error.h"
#include "capture/sync/pairing_reader.h"
#include "server/pipeline/service_config.h"
#include "tests/capture/live/openni_test_pictures.h"
#include "tests/capture/recorded/oni_recording.h"
#include "tests/server/tiny_session.h"

namespace lumigraft::server {
namespace {

using namespace std::chrono_literals;

std::unique_ptr<capture::FrameReader> frames_of(const std::filesystem::path& folder) {
  ServiceFiles files;
  files.session = folder;
  return capture::open_frames(read_service(files, interactive_plan()).session);
}

TEST(Tum, ThereAndBackItIsTheSameSession) {
  const TinySession tiny("tum");
  std::ostringstream report;
  run_export({tiny.folder, tiny.folder / "tum", {}}, false, report);
  EXPECT_NE(report.str().find("colour: 3 pictures\n  depth: 3 pictures\n"), std::string::npos) << report.str();
  run_import({tiny.folder / "tum", tiny.folder / "back", {"color.fx=61.5", "name=again"}}, false, report);
  const auto one = frames_of(tiny.folder), other = frames_of(tiny.folder / "back");
  for (int i = 0; i < TinySession::kFrames; ++i) {
    const auto x = one->next(0ms), y = other->next(0ms);
    ASSERT_TRUE(x && y);
    EXPECT_EQ(x->time_ns, y->time_ns);
    EXPECT_EQ(x->color->encoded.data, y->color->encoded.data);
    ASSERT_TRUE(x->depth && y->depth);
    for (std::size_t p = 0; p < x->depth->depth_m.data.size(); ++p) {
      ASSERT_FLOAT_EQ(x->depth->depth_m.data[p], y->depth->depth_m.data[p]);
    }
  }
  ServiceFiles files;
  files.session = tiny.folder / "back";
  const capture::Session session = read_service(files, interactive_plan()).session;
  EXPECT_EQ(session.color.model.fx, 61.5);
  EXPECT_EQ(session.name, "again");
  EXPECT_EQ(session.depth->unit_m, 0.0002);
}

TEST(Oni, BecomesASession) {
  const TinySession tiny("oni");
  const std::filesystem::path file = tiny.folder / "capture.oni";
  test::record_oni(file, 15);
  const std::vector<std::string> size = {"color.width=" + std::to_string(test::kDeviceWidth),
                                         "color.height=" + std::to_string(test::kDeviceHeight)};
  std::ostringstream report;
  run_import({file, tiny.folder / "session", size}, false, report);
  const auto frames = frames_of(tiny.folder / "session");
  int count = 0, with_depth = 0;
  std::optional<int> first;
  while (const auto frame = frames->next(0ms)) {
    const auto of_device = [&](int i) { return frame->color->encoded.at(5, 6, 2) == test::device_color(i, 5, 6, 2); };
    const int index = static_cast<int>((frame->time_ns / 1000 + 16'000) / 33'333);
    for (int i = 0; !first && i < 100; ++i) {
      if (of_device(i + index)) first = i;
    }
    ASSERT_TRUE(first && of_device(*first + index)) << "picture " << count;
    with_depth += frame->depth ? 1 : 0;
    ++count;
  }
  EXPECT_GE(count, 4);
  EXPECT_GE(with_depth, count - 2);
  EXPECT_NE(report.str().find("colour: " + std::to_string(count) + " pictures\n"), std::string::npos) << report.str();
  std::filesystem::resize_file(file, 200);
  try {
    run_import({file, tiny.folder / "cut", size}, false, report);
    FAIL() << "taken";
  } catch (const capture::InputError& e) {
    EXPECT_NE(std::string(e.what()).find("capture.oni: found "), std::string::npos) << e.what();
  }
}

TEST(Tum, WhatIsWrongIsSaidWithItsLine) {
  const TinySession tiny("tum-bad");
  std::ostringstream report;
  const auto error = [&](const std::filesystem::path& from, const char* out) -> std::string {
    try {
      run_import({from, tiny.folder / out, {}}, false, report);
    } catch (const capture::InputError& e) {
      return e.what();
    }
    return "no error";
  };
  EXPECT_NE(error(tiny.folder, "a").find("found neither, allowed: a TUM folder (rgb.txt) or an .oni file"),
            std::string::npos);
  run_export({tiny.folder, tiny.folder / "tum", {}}, false, report);
  EXPECT_NE(error(tiny.folder / "tum", "tum").find("in use, allowed: a folder that is new or empty"),
            std::string::npos);
  std::ofstream(tiny.folder / "tum" / "depth.txt", std::ios::app) << "99.0 depth/none.png\n";
  EXPECT_NE(error(tiny.folder / "tum", "b").find("depth.txt:5: depth/none.png: No such file"), std::string::npos)
      << error(tiny.folder / "tum", "c");
}

TEST(Tum, TheBenchmarksOwnPictures) {
  const char* extra = std::getenv("LUMIGRAFT_EXTRA");
  const std::filesystem::path data = std::filesystem::path(extra ? extra : "") / "data/rgbd-small/tum-fr1";
  if (extra == nullptr || !std::filesystem::exists(data)) {
    GTEST_SKIP() << "LUMIGRAFT_EXTRA names no folder with data/rgbd-small/tum-fr1";
  }
  const TinySession tiny("tum-real");
  const std::filesystem::path folder = tiny.folder / "fr1";
  std::filesystem::create_directories(folder / "rgb");
  std::filesystem::create_directories(folder / "depth");
  std::ofstream rgb(folder / "rgb.txt"), depth(folder / "depth.txt");
  rgb << "# color images\n# file: 'rgbd_dataset_freiburg1_xyz.bag'\n# timestamp filename\n";
  for (const auto& entry : std::filesystem::directory_iterator(data)) {
    const std::string name = entry.path().filename().string();
    const bool is_depth = name.rfind("depth_", 0) == 0;
    const std::string time = name.substr(is_depth ? 6 : 0, 17);
    std::filesystem::copy_file(entry.path(), folder / (is_depth ? "depth" : "rgb") / (time + ".png"));
  }
  for (const char* time : {"1305031790.645155", "1305031790.913129"}) rgb << time << " rgb/" << time << ".png\n";
  for (const char* time : {"1305031790.640468", "1305031790.909436"}) depth << time << " depth/" << time << ".png\n";
  rgb.close();
  depth.close();
  std::ostringstream report;
  run_import({folder, tiny.folder / "session", {}}, false, report);
  const auto frames = frames_of(tiny.folder / "session");
  for (int i = 0; i < 2; ++i) {
    const auto frame = frames->next(0ms);
    ASSERT_TRUE(frame && frame->depth);
    EXPECT_EQ(frame->color->encoded.width, 640);
    std::vector<float> measured;
    for (const float d : frame->depth->depth_m.data) {
      if (d > 0) measured.push_back(d);
    }
    EXPECT_GT(measured.size(), frame->depth->depth_m.data.size() / 2);
    std::nth_element(measured.begin(), measured.begin() + static_cast<std::ptrdiff_t>(measured.size() / 2),
                     measured.end());
    EXPECT_GT(measured[measured.size() / 2], 0.5f) << "a desk, in metres";
    EXPECT_LT(measured[measured.size() / 2], 3.0f);
  }
}

}  // namespace
}  // namespace lumigraft::server
