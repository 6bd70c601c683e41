// From pictures of a board to a calibration that a session takes.
#include "server/calibrate.h"

#include <gtest/gtest.h>

#include <fstream>
#include <sstream>

#include "capture/error.h"
#include "server/write_picture.h"
#include "tests/capture/scratch_folder.h"
#include "tests/reconstruct/board_views.h"

namespace lumigraft {
namespace {

class Calibrate : public test::ScratchFolder {
 protected:
  static CameraModel camera() {
    CameraModel small;
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
      write_png(folder_ / name, drawing.picture(pose, {.seed = static_cast<unsigned>(number + 1)}).encoded);
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
  Session session_of(const std::string& name) const {
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
  const CameraModel found = session_of("calibrated.toml").color.model;
  EXPECT_NEAR(found.fx, camera().fx, 0.002 * camera().fx);
  EXPECT_NEAR(found.cx, camera().cx, 0.5);
  EXPECT_NEAR(found.cy, camera().cy, 0.5);

  // The same pictures in a folder: the same bytes, but for the serial number that no folder knows.
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
  } catch (const InputError& e) {
    EXPECT_NE(std::string(e.what()).find("color.width: found 320, allowed: that of the camera in"), std::string::npos)
        << e.what();
  }
}

TEST_F(Calibrate, RefusesWithOneReasonAndWritesNothing) {
  CalibrateCommand few = command();
  few.color = folder_ / "color";
  for (int i = 12; i < 22; ++i) std::filesystem::remove(folder_ / "color" / (std::to_string(i) + ".png"));
  EXPECT_EQ(
      refusal(few),
      "calibration refused: colour: too few views: found 2 pictures that show the board in a new place, allowed: at "
      "least 8");
  write_png(folder_ / "color" / "99.png", Image<std::uint8_t>(64, 48, 3, 200));
  EXPECT_NE(refusal(few).find("99.png: found 64x48 pixels, allowed: 320x240"), std::string::npos) << refusal(few);
  std::ofstream(folder_ / "board.toml") << "rows = 3\ncolumns = 4\nsize_m = 0.05\nspacing_m = 0.0125\nfirst_id = 100\n";
  std::filesystem::remove(folder_ / "color" / "99.png");
  EXPECT_NE(refusal(few).find("no picture shows the board"), std::string::npos) << refusal(few);
  few.color = folder_ / "none";
  EXPECT_NE(refusal(few).find("allowed: a folder of pictures"), std::string::npos) << refusal(few);
}

}  // namespace
}  // namespace lumigraft
