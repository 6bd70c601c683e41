// Sessions whose lenses are described by a calibration file.
#include <gtest/gtest.h>

#include <fstream>

#include "capture/error.h"
#include "capture/session/session.h"
#include "tests/capture/scratch_folder.h"

namespace lumigraft::capture {
namespace {

class CalibratedSession : public test::ScratchFolder {
 protected:
  void SetUp() override {
    ScratchFolder::SetUp();
    std::ofstream(folder_ / "kiosk.toml") << R"(format = 1
calibration = "lens/calibration.toml"
[color]
source = "aravis:Maker-17"
width = 640
height = 480
exposure = 3.0
[fisheye]
source = "aravis:"
width = 512
height = 512
exposure = 6.1
T_tag_fisheye = [[1, 0, 0, 0.5], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]
[tag]
id = 2
size_m = 0.16
)";
    std::filesystem::create_directories(folder_ / "lens");
    calibrate("640", "Maker-17");
  }
  void calibrate(const std::string& width, const std::string& serial, const std::string& more = "") const {
    std::ofstream(folder_ / "lens" / "calibration.toml") << "format = 1\n[color]\nwidth = " << width << R"(
height = 480
fx = 531.5
fy = 529.25
cx = 320.5
cy = 240.5
distortion = [-0.2, 0.07, 0.001, -0.002, 0.01]
)" << (serial.empty() ? "" : "serial = \"" + serial + "\"\n")
                                                         << R"([fisheye]
width = 512
height = 512
serial = "another"
model = "kannala-brandt"
fx = 156.0
fy = 155.5
cx = 257.0
cy = 252.0
k = [-0.012, 0.004, -0.0016, 0.0002]
fov_degrees = 180.0
)" << more;
  }
  Session kiosk(const std::vector<std::string>& overrides = {}) const {
    const ConfigTable root = ConfigTable::load(folder_ / "kiosk.toml", overrides);
    Session session = read_session(root);
    root.finish();
    return session;
  }
  std::string refusal(const std::vector<std::string>& overrides = {}) const {
    try {
      kiosk(overrides);
    } catch (const InputError& e) {
      return e.what();
    }
    return "no error";
  }
};

TEST_F(CalibratedSession, ReadsLensesFromTheCalibration) {
  const Session s = kiosk();
  EXPECT_EQ(s.color.model.fx, 531.5);
  EXPECT_EQ(s.color.model.distortion[0], -0.2);
  EXPECT_EQ(s.color.serial, "Maker-17");
  EXPECT_EQ(s.fisheye->serial, "another") << "of the calibration";
  EXPECT_EQ(s.fisheye->model.kind, CameraModel::Kind::kannala_brandt);
  EXPECT_EQ(s.fisheye->model.k[1], 0.004);
  EXPECT_EQ(s.fisheye->T_tag_fisheye.translation().x(), 0.5);
  std::ofstream(folder_ / "lens" / "curve.txt") << [] {
    std::string lines;
    for (int i = 0; i < 256; ++i) lines += std::to_string(i / 255.0 * (i / 255.0)) + "\n";
    return lines;
  }();
  calibrate("640", "",
            "response = \"curve.txt\"\nT_tag_fisheye = [[1, 0, 0, 2], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]");
  std::string text;
  {
    std::ifstream in(folder_ / "kiosk.toml");
    text.assign(std::istreambuf_iterator<char>(in), {});
  }
  const std::size_t at = text.find("T_tag_fisheye");
  std::ofstream(folder_ / "kiosk.toml") << text.erase(at, text.find('\n', at) - at);
  EXPECT_NEAR(kiosk().fisheye->response.to_linear(51), 0.04f, 1e-6f) << "relative to the calibration's folder";
  EXPECT_EQ(kiosk().fisheye->T_tag_fisheye.translation().x(), 2);
}

TEST_F(CalibratedSession, ReadsVignettingTimeOffsetAndDepthPose) {
  calibrate("640", "Maker-17", R"(vignetting = [-0.3, 0.05, -0.02]
time_offset_s = -0.0125
[depth]
width = 320
height = 240
serial = "depth-4"
noise_scale = 1.5
T_color_depth = [[1, 0, 0, 0.025], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]
)");
  const Session without = kiosk();  // the calibration has a camera that the session lacks
  EXPECT_FALSE(without.depth);
  EXPECT_EQ(without.fisheye->vignetting.terms, (std::array{-0.3, 0.05, -0.02}));
  EXPECT_EQ(without.fisheye->time_offset_s, -0.0125);
  const std::vector<std::string> depth = {"depth.source=mkv:depth.mkv",
                                          "depth.registered=false",
                                          "depth.width=320",
                                          "depth.height=240",
                                          "depth.fx=280",
                                          "depth.fy=280",
                                          "depth.cx=159.5",
                                          "depth.cy=119.5",
                                          "depth.unit_m=0.001"};
  const auto with = [&](const std::string& more) {
    std::vector<std::string> all = depth;
    if (!more.empty()) all.push_back(more);
    return all;
  };
  EXPECT_EQ(kiosk(depth).depth->T_color_depth.translation().x(), 0.025);
  EXPECT_EQ(kiosk(with("depth.principle=time-of-flight")).depth_noise().curvature_per_m,
            usual_noise(DepthPrinciple::time_of_flight, 1.5).curvature_per_m);
  EXPECT_NE(refusal(with("depth.noise_scale=2")).find("depth.noise_scale: found it here and in "), std::string::npos)
      << refusal(with("depth.noise_scale=2"));
  EXPECT_EQ(refusal(with("depth.serial=depth-4")), "no error");
  EXPECT_NE(refusal(with("depth.serial=depth-5")).find("depth.serial: found \"depth-4\", allowed: that of the camera"),
            std::string::npos)
      << refusal(with("depth.serial=depth-5"));
  EXPECT_NE(refusal(with("depth.T_color_depth=[[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]")).find("found together with"),
            std::string::npos);
  std::vector<std::string> wide = depth;
  wide[2] = "depth.width=640";
  EXPECT_NE(refusal(wide).find("depth.width: found 320, allowed: that of the camera in"), std::string::npos)
      << refusal(wide);
  const std::string registered = refusal({"depth.source=mkv:depth.mkv", "depth.unit_m=0.001"});
  EXPECT_NE(
      registered.find("depth.T_color_depth: found it for depth on its own pixels, allowed: registered = false in"),
      std::string::npos)
      << registered;
}

TEST_F(CalibratedSession, RefusesACalibrationOfAnotherCamera) {
  calibrate("1280", "Maker-17");
  EXPECT_NE(refusal().find("calibration.toml:3: color.width: found 1280, allowed: that of the camera in"),
            std::string::npos)
      << refusal();
  EXPECT_NE(refusal().find("kiosk.toml, 640"), std::string::npos) << refusal();
  calibrate("640", "Maker-18");
  EXPECT_NE(refusal().find("color.serial: found \"Maker-18\", allowed: that of the camera in"), std::string::npos)
      << refusal();
  EXPECT_EQ(refusal({"color.serial=Maker-18"}), "no error") << "the key `serial` has precedence over the source";
  calibrate("640", "");
  EXPECT_EQ(refusal(), "no error") << "unknown serial number";
  EXPECT_NE(refusal({"fisheye.serial=one"}).find("fisheye.serial: found \"another\""), std::string::npos);
}

TEST_F(CalibratedSession, RefusesAnotherCameraForEveryKindOfSource) {
  for (const std::string source :
       {"images:color.txt", "mkv:color.mkv", "oni:rgbd.oni", "openni2:", "v4l2:", "v4l2:/dev/video0",
        "libcamera:imx219", "aravis:", "v4l2:usb-Maker_Cam_42-video-index0", "aravis:Maker-42"}) {
    const std::string set = "color.source=\"" + source + "\"";
    calibrate("640", "Maker-17");
    EXPECT_EQ(refusal({set, "color.serial=Maker-17"}), "no error") << source;
    EXPECT_NE(refusal({set, "color.serial=Maker-18"}).find("color.serial: found \"Maker-17\", allowed: that of"),
              std::string::npos)
        << source;
    const bool named = source.find("42") != std::string::npos;
    EXPECT_EQ(refusal({set}).find("color.serial: found \"Maker-17\"") != std::string::npos, named)
        << source << ": " << refusal({set});
    calibrate("320", "");
    EXPECT_NE(refusal({set}).find("color.width: found 320, allowed: that of"), std::string::npos) << source;
  }
  calibrate("640", "usb-Maker_Cam_42-video-index0");
  EXPECT_EQ(refusal({"color.source=v4l2:usb-Maker_Cam_42-video-index0"}), "no error");
  EXPECT_EQ(refusal({"color.source=v4l2:/dev/v4l/by-id/usb-Maker_Cam_42-video-index0"}), "no error");
}

TEST_F(CalibratedSession, RefusesLensesInBothFiles) {
  EXPECT_NE(refusal({"color.fx=500"}).find("--set color.fx: found together with "), std::string::npos) << refusal();
  EXPECT_NE(refusal({"fisheye.f=150"}).find("--set fisheye.f: found together with "), std::string::npos) << refusal();
  EXPECT_NE(refusal({"calibration=none.toml"}).find("calibration"), std::string::npos);
  calibrate("640", "Maker-17", "colour = 3");
  EXPECT_NE(refusal().find("colour"), std::string::npos) << "an unknown table";
}

}  // namespace
}  // namespace lumigraft::capture
