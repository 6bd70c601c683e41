// `lumigraft calibrate`, from pictures of a board to a calibration that a session uses.
#include "server/commands/calibrate.h"

#include <gtest/gtest.h>

#include <fstream>
#include <functional>
#include <sstream>

#include "capture/error.h"
#include "capture/formats/picture_writer.h"
#include "server/commands/calibrate_guide.h"
#include "tests/capture/scratch_folder.h"
#include "tests/reconstruct/calibrate/board_views.h"

namespace lumigraft::server {
namespace {

class Calibrate : public test::ScratchFolder {
 protected:
  static capture::CameraModel camera() {
    capture::CameraModel small;
    small.width = 320;
    small.height = 240;
    small.fx = small.fy = 262.5;
    small.cx = 161.5;
    small.cy = 118.5;
    return small;
  }
  void SetUp() override {
    ScratchFolder::SetUp();
    std::ofstream(folder_ / "board.toml") << "rows = 3\ncolumns = 4\nsize_m = 0.05\nspacing_m = 0.0125\n";
    std::filesystem::create_directories(folder_ / "color");
    const test::BoardDrawing drawing(test::test_board(), camera());
    std::ofstream list(folder_ / "color.txt");
    int number = 0;
    for (const Eigen::Isometry3d& pose : test::pinhole_poses(12)) {
      const std::string name = "color/" + std::to_string(10 + number) + ".png";
      capture::write_png(folder_ / name, drawing.picture(pose, {.seed = static_cast<unsigned>(number + 1)}).encoded);
      list << number++ << " " << name << '\n';
    }
    write_session("session.toml", "fx = 300\nfy = 300\ncx = 160\ncy = 120\n", "");
  }
  void write_session(const std::string& name, const std::string& lens, const std::string& calibration) const {
    std::ofstream(folder_ / name) << "format = 1\n"
                                  << calibration
                                  << "[color]\nsource = \"images:color.txt\"\nwidth = 320\nheight = 240\n"
                                  << lens << "exposure = 1\nserial = \"seventeen\"\n[tag]\nid = 40\nsize_m = 0.16\n";
  }
  capture::Session session_of(const std::string& name) const {
    ServiceFiles files;
    files.config = folder_ / name;
    return read_service(files, interactive_plan()).session;
  }
  CalibrateCommand command() const {
    CalibrateCommand command;
    command.board = folder_ / "board.toml";
    command.out = folder_ / "calibration.toml";
    return command;
  }
  std::string refusal(const CalibrateCommand& command) const {
    std::ostringstream report;
    try {
      run_calibrate(command, false, report);
    } catch (const std::exception& e) {
      EXPECT_FALSE(std::filesystem::exists(command.out));
      return e.what();
    }
    return "no error";
  }
};

TEST_F(Calibrate, ASessionGivesTheCalibrationThatItTakes) {
  CalibrateCommand from_session = command();
  from_session.files.session = folder_;
  std::ostringstream report;
  run_calibrate(from_session, false, report);
  EXPECT_NE(report.str().find("colour: 12 views, "), std::string::npos) << report.str();
  EXPECT_NE(report.str().find(" ± "), std::string::npos) << report.str();
  write_session("calibrated.toml", "", "calibration = \"calibration.toml\"\n");
  const capture::CameraModel found = session_of("calibrated.toml").color.model;
  EXPECT_NEAR(found.fx, camera().fx, 0.002 * camera().fx);
  EXPECT_NEAR(found.cx, camera().cx, 0.5);
  EXPECT_NEAR(found.cy, camera().cy, 0.5);

  // The same pictures from a folder give the same bytes, except for the serial number, which a folder does not have.
  CalibrateCommand from_folder = command();
  from_folder.color = folder_ / "color";
  from_folder.out = folder_ / "from_folder.toml";
  run_calibrate(from_folder, false, report);
  const auto text = [&](const char* name) {
    std::ifstream in(folder_ / name);
    return std::string(std::istreambuf_iterator<char>(in), {});
  };
  std::string with_serial = text("calibration.toml");
  const std::string serial = "serial = \"seventeen\"\n";
  ASSERT_NE(with_serial.find(serial), std::string::npos);
  EXPECT_EQ(with_serial.erase(with_serial.find(serial), serial.size()), text("from_folder.toml"));

  ServiceFiles other;
  other.config = folder_ / "calibrated.toml";
  other.overrides = {"color.width=640"};
  try {
    read_service(other, interactive_plan());
    FAIL() << "taken";
  } catch (const capture::InputError& e) {
    EXPECT_NE(std::string(e.what()).find("color.width: found 320, allowed: that of the camera in"), std::string::npos)
        << e.what();
  }
}

TEST_F(Calibrate, ThePageMayEndItOnceThereAreViewsEnough) {
  CalibrateGuide guide({camera(), std::nullopt});
  reconstruct::ViewSelector collector(test::test_board(), std::nullopt);
  const test::BoardDrawing drawing(test::test_board(), camera());
  EXPECT_EQ(guide.ask("/finish").status, 409u);
  EXPECT_EQ(guide.ask("/none").status, 404u);
  std::int64_t time_ns = 0;
  for (const Eigen::Isometry3d& pose : test::pinhole_poses(12)) {
    capture::FrameSet frame;
    frame.time_ns = time_ns += 1'000'000'000;
    frame.color = std::make_shared<const capture::Frame>(drawing.picture(pose, {}));
    collector.add(frame.time_ns, frame.color.get(), capture::Response::srgb(), {}, capture::Response::srgb());
    guide.add(frame, collector);
    const bool enough = collector.moments().size() >= 8;
    const std::string can = enough ? "\"can_finish\":true" : "\"can_finish\":false";
    EXPECT_NE(guide.reply("/calibrate.json").body.find(can), std::string::npos) << collector.moments().size();
  }
  EXPECT_FALSE(guide.finish_asked());
  EXPECT_EQ(guide.ask("/finish").status, 200u);
  EXPECT_TRUE(guide.finish_asked());
  EXPECT_EQ(guide.ask("/finish").status, 409u) << "once";
  guide.go_on("too blurred");
  EXPECT_FALSE(guide.finish_asked());
  EXPECT_NE(guide.reply("/calibrate.json").body.find("\"refusal\":\"too blurred. Go on.\""), std::string::npos);
}

TEST_F(Calibrate, WhatIsCoveredAndRefusedIsTriedAgainAfterSomeMoreViews) {
  CalibrateGuide guide({camera(), std::nullopt});
  reconstruct::ViewSelector collector(test::test_board(), std::nullopt);
  const test::BoardDrawing drawing(test::test_board(), camera());
  std::int64_t time_ns = 0;
  const auto show = [&](const Eigen::Isometry3d& pose) {
    capture::FrameSet frame;
    frame.time_ns = time_ns += 1'000'000'000;
    frame.color = std::make_shared<const capture::Frame>(drawing.picture(pose, {}));
    collector.add(frame.time_ns, frame.color.get(), capture::Response::srgb(), {}, capture::Response::srgb());
    guide.add(frame, collector);
  };
  const auto poses = test::pinhole_poses(48);
  std::size_t shown = 0;
  while (shown < poses.size() && !guide.covered()) show(poses[shown++]);
  ASSERT_TRUE(guide.covered()) << guide.reply("/calibrate.json").body;
  guide.go_on("too blurred");
  EXPECT_FALSE(guide.covered());
  show(poses[shown - 1]);
  EXPECT_FALSE(guide.covered()) << "nothing new was seen";
  const std::size_t refused = collector.moments().size();
  while (shown < poses.size() && !guide.covered()) show(poses[shown++]);
  EXPECT_TRUE(guide.covered());
  EXPECT_EQ(collector.moments().size(), refused + 5);
}

/// Colour, fish-eye and depth see a board that is still, then moving; the fish-eye's clock has an offset.
class CalibrateRig : public Calibrate {
 protected:
  static constexpr double kBehind_s = 0.021;
  static constexpr capture::Vignetting kFalloff{{-0.3, 0.02, -0.02}};
  static capture::CameraModel fisheye() {
    capture::CameraModel small = test::test_fisheye();
    small.width = small.height = 320;
    small.fx = 231.5;
    small.fy = 230.7;
    small.cx = 161.2;
    small.cy = 157.7;
    return small;
  }
  static Eigen::Isometry3d true_T_fisheye_color() {
    return Eigen::Translation3d(0.04, -0.02, 0.01) * Eigen::AngleAxisd(0.06, Eigen::Vector3d(0.2, 1, 0).normalized());
  }
  static Eigen::Isometry3d true_T_color_depth() {
    return Eigen::Translation3d(0.03, 0.002, 0.001) * Eigen::AngleAxisd(0.02, Eigen::Vector3d(1, 0.3, 0).normalized());
  }
  /// Writes a picture list; `lines` writes its entries.
  void write(const std::string& name, const std::function<void(std::ostream&)>& lines) const {
    std::ofstream list(folder_ / (name + ".txt"));
    list.precision(12);
    lines(list);
  }
  void see(std::ostream& list, const std::string& name, int number, double time_s,
           const capture::Image<std::uint8_t>& rgb) const {
    const std::string file = name + "/" + std::to_string(1000 + number) + ".png";
    capture::write_png(folder_ / file, rgb);
    list << time_s << ' ' << file << '\n';
  }
  static Eigen::Isometry3d moving(double time_s) {
    return test::board_at(0.36, 0.1 * std::sin(6 * time_s), 0.4, 0.4 + 0.15 * std::cos(5 * time_s), 0.8, 0.1);
  }
};

TEST_F(CalibrateRig, EverythingIsFoundAndTheFileIsTaken) {
  const reconstruct::Board board = test::test_board();
  const auto poses = test::pinhole_poses(12);
  const test::BoardDrawing before_color(board, camera()), before_fisheye(board, fisheye());
  std::filesystem::create_directories(folder_ / "fisheye");
  std::filesystem::create_directories(folder_ / "depth");
  const capture::Image<float> gain = capture::vignetting_gain(kFalloff, fisheye());
  const auto through_fisheye = [&](const Eigen::Isometry3d& pose, unsigned seed) {
    capture::Image<float> light = before_fisheye.light(true_T_fisheye_color() * pose, {.electrons = 0});
    for (std::size_t i = 0; i < light.data.size(); ++i) light.data[i] *= 0.9f / gain.data[i];
    test::sense(light, {.blur_px = 0, .seed = seed});
    return test::encoded(light).encoded;
  };
  constexpr int kMoving = 25;
  write("color", [&](std::ostream& list) {
    for (int i = 0; i < 12; ++i)
      see(list, "color", i, i, before_color.picture(poses[static_cast<std::size_t>(i)], {.seed = 1u + i}).encoded);
    for (int i = 0; i < kMoving; ++i)
      see(list, "color", 100 + i, 20 + 0.1 * i, before_color.picture(moving(0.1 * i), {.seed = 100u + i}).encoded);
  });
  write("fisheye", [&](std::ostream& list) {
    for (int i = 0; i < 12; ++i)
      see(list, "fisheye", i, i, through_fisheye(poses[static_cast<std::size_t>(i)], 500 + i));
    for (int i = 0; i < kMoving; ++i)  // 30 ms after colour
      see(list, "fisheye", 100 + i, 20 + 0.1 * i + 0.03 - kBehind_s, through_fisheye(moving(0.1 * i + 0.03), 600 + i));
  });
  write("depth", [&](std::ostream& list) {
    std::mt19937 random(9);
    std::normal_distribution<double> gauss(0, 0.0015);
    for (int i = 0; i < 12; ++i) {
      const Eigen::Isometry3d T_board_depth = poses[static_cast<std::size_t>(i)].inverse() * true_T_color_depth();
      const Eigen::Vector2d half = 0.5 * board.extent_m() + Eigen::Vector2d::Constant(0.5 * board.size_m);
      capture::Image<std::uint16_t> counts(320, 240, 1);
      for (int v = 0; v < 240; ++v)
        for (int u = 0; u < 320; ++u) {
          const Eigen::Vector3d ray((u - 159.5) / 280, (v - 119.5) / 280, 1), from = T_board_depth.translation();
          const Eigen::Vector3d d = T_board_depth.linear() * ray;
          double z = -from.z() / d.z();
          const Eigen::Vector3d at = from + z * d;
          if (!(z > 0) || std::abs(at.x()) > half.x() || std::abs(at.y()) > half.y()) z = 1.4;
          counts.at(u, v) = static_cast<std::uint16_t>(std::lround(1000 * (z + z * z * gauss(random))));
        }
      const std::string file = "depth/" + std::to_string(1000 + i) + ".png";
      capture::write_png(folder_ / file, counts);
      list << i << ' ' << file << '\n';
    }
  });
  const auto rig = [&](const std::string& name, bool lenses) {
    std::ofstream(folder_ / name) << "format = 1\n"
                                  << (lenses ? "" : "calibration = \"calibration.toml\"\n")
                                  << "[color]\nsource = \"images:color.txt\"\nwidth = 320\nheight = 240\nexposure = 1\n"
                                  << (lenses ? "fx = 300\nfy = 300\ncx = 160\ncy = 120\n" : "")
                                  << "[depth]\nsource = \"images:depth.txt\"\nunit_m = 0.001\nregistered = false\n"
                                     "fx = 280\nfy = 280\ncx = 159.5\ncy = 119.5\n"
                                  << (lenses ? "T_color_depth = [[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]\n" : "")
                                  << "[fisheye]\nsource = \"images:fisheye.txt\"\nwidth = 320\nheight = 320\n"
                                     "exposure = 1\n"
                                     "T_tag_fisheye = [[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]\n"
                                  << (lenses ? "f = 220\ncx = 160\ncy = 160\nfov_degrees = 76\ntime_offset_s = 0.5\n"
                                             : "")
                                  << "[tag]\nid = 40\nsize_m = 0.16\n";
  };
  rig("session.toml", true);
  CalibrateCommand from_rig = command();
  from_rig.files.session = folder_;
  std::ostringstream report;
  run_calibrate(from_rig, false, report);
  rig("calibrated.toml", false);
  const capture::Session found = session_of("calibrated.toml");
  EXPECT_NEAR(found.color.model.fx, camera().fx, 0.003 * camera().fx);
  EXPECT_NEAR(found.fisheye->time_offset_s, kBehind_s, 0.002) << report.str();
  for (const double degrees : {10, 20, 30})
    EXPECT_NEAR(found.fisheye->vignetting.transmission(degrees * test::kTestDegree),
                kFalloff.transmission(degrees * test::kTestDegree), 0.02)
        << report.str();
  const Eigen::Isometry3d off = found.depth->T_color_depth * true_T_color_depth().inverse();
  EXPECT_LT(off.translation().norm(), 0.003) << report.str();
  EXPECT_LT(Eigen::AngleAxisd(off.linear()).angle(), 0.3 * test::kTestDegree) << report.str();
  EXPECT_NE(report.str().find("depth to colour: 12 views"), std::string::npos) << report.str();
}

TEST_F(Calibrate, RefusesWithOneReasonAndWritesNothing) {
  CalibrateCommand few = command();
  few.color = folder_ / "color";
  for (int i = 12; i < 22; ++i) std::filesystem::remove(folder_ / "color" / (std::to_string(i) + ".png"));
  EXPECT_EQ(
      refusal(few),
      "calibration refused: colour: too few views: found 2 pictures that show the board in a new place, allowed: at "
      "least 8");
  capture::write_png(folder_ / "color" / "99.png", capture::Image<std::uint8_t>(64, 48, 3, 200));
  EXPECT_NE(refusal(few).find("99.png: found 64x48 pixels, allowed: 320x240"), std::string::npos) << refusal(few);
  std::ofstream(folder_ / "board.toml") << "rows = 3\ncolumns = 4\nsize_m = 0.05\nspacing_m = 0.0125\nfirst_id = 100\n";
  std::filesystem::remove(folder_ / "color" / "99.png");
  EXPECT_NE(refusal(few).find("no picture shows the board"), std::string::npos) << refusal(few);
  few.color = folder_ / "none";
  EXPECT_NE(refusal(few).find("allowed: a folder of pictures"), std::string::npos) << refusal(few);
}

}  // namespace
}  // namespace lumigraft::server
