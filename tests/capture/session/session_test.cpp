#include "capture/session/session.h"

#include <gtest/gtest.h>

#include <fstream>

#include "capture/error.h"
#include "tests/capture/scratch_folder.h"

namespace lumigraft::capture {
namespace {

constexpr const char* kCompleteSession = R"(format = 1
name = "tabletop"
about = "one line"
[color]
source = "images:color.txt"
width = 640
height = 480
fx = 525.0
fy = 526.0
cx = 319.5
cy = 239.5
distortion = [0.1, 0.2, 0.3, 0.4, 0.5]
exposure = 3.27
response = "linear"
[depth]
source = "mkv:depth.mkv"
unit_m = 0.0002
registered = false
fx = 580
fy = 581
cx = 314
cy = 252
T_color_depth = [[0, -1, 0, 0.025], [1, 0, 0, 0], [0, 0, 1, 0.001], [0, 0, 0, 1]]
[fisheye]
source = "images:fisheye.txt"
width = 512
height = 512
model = "equidistant"
f = 154.4
cx = 255.5
cy = 255.5
fov_degrees = 190.0
exposure = 6.1
T_tag_fisheye = [[0.64278761, -0.766044443, 0.0, -0.28], [0.766044443, 0.64278761, 0.0, -0.02], [0.0, 0.0, 1.0, 0.03], [0.0, 0.0, 0.0, 1.0]]
[tag]
family = "tag36h11"
id = 2
size_m = 0.16
[[real_surface]]
mesh = "floor.ply"
roughness = 0.2
metallic = 1.0
base_color = [0.6, 0.5, 0.4]
specular = 1.0
)";

class SessionFile : public test::ScratchFolder {
 protected:
  void SetUp() override {
    ScratchFolder::SetUp();
    std::ofstream(folder_ / "floor.ply") << "ply\n";
    std::ofstream(folder_ / "session.toml") << kCompleteSession;
  }

  Session read(const std::vector<std::string>& overrides = {}) const {
    const ConfigTable root = ConfigTable::load(folder_ / "session.toml", overrides);
    Session session = read_session(root);
    root.finish();
    return session;
  }
  std::string error(const std::vector<std::string>& overrides) const {
    try {
      read(overrides);
    } catch (const InputError& e) {
      EXPECT_EQ(std::string(e.what()).find('\n'), std::string::npos);
      return e.what();
    }
    return "no error";
  }
  /// The error of the complete session after one part of its text was replaced.
  std::string error_with(const std::string& piece, const std::string& replacement) const {
    std::string text = kCompleteSession;
    const std::size_t at = text.find(piece);
    EXPECT_NE(at, std::string::npos) << piece;
    std::ofstream(folder_ / "session.toml") << text.replace(at, piece.size(), replacement);
    return error({});
  }
};

TEST_F(SessionFile, SettingsOfLiveCameras) {
  const Session live =
      read({"color.source=aravis:Some-Camera", "color.pixel_format=bayer-rggb8", "color.rate_hz=29.5",
            "color.exposure_us=5000", "color.controls.BlackLevel=3", "color.controls.Another=-0.5", "fisheye.gain=2"});
  EXPECT_EQ(live.color.source, "aravis:Some-Camera");
  EXPECT_EQ(live.color.settings.pixel_format, PixelFormat::bayer_rggb8);
  EXPECT_EQ(live.color.settings.rate_hz, 29.5);
  EXPECT_EQ(live.color.settings.exposure_us, 5000.0);
  EXPECT_FALSE(live.color.settings.gain);
  EXPECT_EQ(live.color.settings.controls,
            (std::vector<std::pair<std::string, double>>{{"Another", -0.5}, {"BlackLevel", 3.0}}));
  EXPECT_EQ(live.fisheye->settings.gain, 2.0);
  EXPECT_EQ(read({"color.controls.BalanceRatio[Red]=1.75"}).color.settings.controls.at(0),
            (std::pair<std::string, double>{"BalanceRatio[Red]", 1.75}));
  EXPECT_FALSE(live.color.settings.input);
  EXPECT_EQ(read({"color.source=v4l2:/dev/video1", "color.input=HDMI 1"}).color.settings.input, "HDMI 1");
  EXPECT_NE(error({"color.source=aravis:A", "color.input=HDMI 1"}).find("color.input: found it with \"aravis:A\", "),
            std::string::npos);
  const Session bracket = read({"fisheye.exposure_us=1000", "fisheye.bracket_us=[250, 1000, 4000]"});
  EXPECT_EQ(bracket.fisheye->settings.bracket_us, (std::vector{250.0, 1000.0, 4000.0}));
  EXPECT_NE(error({"fisheye.bracket_us=[250, 1000]"}).find("fisheye.bracket_us: found no exposure_us with it"),
            std::string::npos);
  EXPECT_NE(error({"fisheye.exposure_us=1000", "fisheye.bracket_us=[250]"}).find("allowed: an array of 2 to 5 finite"),
            std::string::npos);
  EXPECT_NE(error({"fisheye.exposure_us=1000", "fisheye.bracket_us=[250, 0]"}).find("fisheye.bracket_us: found 0.0"),
            std::string::npos);
  EXPECT_NE(error({"color.pixel_format=rgb9"}).find("found \"rgb9\", allowed: rgb8, "), std::string::npos);
  const std::vector<std::string> depth = {"color.source=v4l2:", "depth.source=v4l2:A", "depth.pixel_format=z16",
                                          "depth.rate_hz=30"};
  EXPECT_EQ(read(depth).depth->settings.pixel_format, PixelFormat::z16);
  EXPECT_EQ(read(depth).depth->settings.rate_hz, 30.0);
  EXPECT_NE(error({"depth.source=openni2:", "depth.rate_hz=30"}).find("depth.rate_hz: found an unknown key"),
            std::string::npos);
  EXPECT_NE(error({"color.source=helper:"}).find("found \"helper:\", allowed: a file after the colon"),
            std::string::npos);
  EXPECT_EQ(read({"color.input=HDMI 1"}).color.settings.input, "HDMI 1") << "a recording of a frame grabber";
  EXPECT_NE(error({"color.exposure_us=0"}).find("color.exposure_us: found 0"), std::string::npos);
  EXPECT_NE(error({"color.controls.Gamma=high"}).find("color.controls.Gamma: found \"high\""), std::string::npos);
}

TEST_F(SessionFile, ReadsEveryKey) {
  const Session s = read();
  EXPECT_EQ(s.name, "tabletop");
  EXPECT_EQ(s.folder, folder_);
  EXPECT_EQ(s.color.source, "images:color.txt");
  EXPECT_EQ(s.color.model.width, 640);
  EXPECT_EQ(s.color.model.fy, 526.0);
  EXPECT_EQ(s.color.model.distortion, (std::array<double, 5>{0.1, 0.2, 0.3, 0.4, 0.5}));
  EXPECT_EQ(s.color.exposure, 3.27);
  EXPECT_EQ(s.color.response.to_linear(128), 128 / 255.0f);
  ASSERT_TRUE(s.depth);
  EXPECT_FALSE(s.depth->registered);
  EXPECT_EQ(s.depth->principle, DepthPrinciple::structured_light);
  EXPECT_EQ(s.depth_noise().least_m, DepthNoise().least_m);
  EXPECT_EQ(s.depth->unit_m, 0.0002);
  EXPECT_EQ(s.depth->model.width, 640) << "default: the colour camera's";
  EXPECT_EQ(s.depth->model.cy, 252.0);
  EXPECT_EQ(s.depth->T_color_depth.translation(), Eigen::Vector3d(0.025, 0, 0.001));
  EXPECT_NEAR((s.depth->T_color_depth * Eigen::Vector3d(1, 0, 0) - Eigen::Vector3d(0.025, 1, 0.001)).norm(), 0, 1e-15);
  ASSERT_TRUE(s.fisheye);
  EXPECT_EQ(s.fisheye->model.kind, CameraModel::Kind::equidistant);
  EXPECT_EQ(s.fisheye->model.fx, 154.4);
  EXPECT_EQ(s.fisheye->model.fy, 154.4);
  EXPECT_NEAR(s.fisheye->model.fov_rad, 3.316125579, 1e-9);
  const Eigen::Matrix3d R = s.fisheye->T_tag_fisheye.linear();
  EXPECT_LT((R * R.transpose() - Eigen::Matrix3d::Identity()).norm(), 1e-14)
      << "the nearest rotation, from nine digits";
  EXPECT_NEAR(R(0, 0), 0.64278761, 1e-8);
  EXPECT_EQ(s.tag.id, 2);
  EXPECT_EQ(s.tag.size_m, 0.16);
  EXPECT_FALSE(s.tag.moves_exhibit);
  EXPECT_TRUE(s.tag.map.empty());
  const Session other = read({"tag.moves=exhibit", "tag.map=room.tags.toml"});
  EXPECT_TRUE(other.tag.moves_exhibit);
  EXPECT_EQ(other.tag.map, folder_ / "room.tags.toml");
  EXPECT_NE(error({"tag.moves=room"}).find("tag.moves: found \"room\""), std::string::npos);
  ASSERT_EQ(s.real_surfaces.size(), 1u);
  EXPECT_EQ(s.real_surfaces[0].name, "floor");
  EXPECT_EQ(s.real_surfaces[0].mesh, folder_ / "floor.ply");
  EXPECT_EQ(s.real_surfaces[0].base_color, Eigen::Vector3f(0.6f, 0.5f, 0.4f));
}

TEST_F(SessionFile, ASurfaceIsTheWorldWithoutATag) {
  std::string text = kCompleteSession;
  const auto cut = [&](const std::string& from, const std::string& to) {
    text.erase(text.find(from), text.find(to) - text.find(from));
    std::ofstream(folder_ / "session.toml") << text;
  };
  EXPECT_TRUE(read().tag.present());
  cut("[tag]", "[[real_surface]]");
  EXPECT_NE(error({}).find("tag: found nothing, but it is needed by fisheye.T_tag_fisheye"), std::string::npos)
      << error({});
  cut("[fisheye]", "[[real_surface]]");
  EXPECT_FALSE(read().tag.present());
  cut("[depth]", "[[real_surface]]");
  EXPECT_NE(error({}).find("tag: found nothing, allowed without [tag]: sessions with [depth]"), std::string::npos)
      << error({});
}

constexpr const char* kExtraTags = R"([[tag.extra]]
id = 7
size_m = 0.08
T_tag_extra = [[0, -1, 0, 0.5], [1, 0, 0, 0], [0, 0, 1, 0.1], [0, 0, 0, 1]]
[[tag.extra]]
id = )";

TEST_F(SessionFile, ExtraTags) {
  const std::string extra = kExtraTags;
  std::ofstream(folder_ / "session.toml") << kCompleteSession + extra + "9\n";
  const Session s = read();
  ASSERT_EQ(s.tag.extra.size(), 2u);
  EXPECT_EQ(s.tag.extra[0].id, 7);
  EXPECT_EQ(s.tag.extra[0].size_m, 0.08);
  ASSERT_TRUE(s.tag.extra[0].T_tag_extra);
  EXPECT_EQ(s.tag.extra[0].T_tag_extra->translation(), Eigen::Vector3d(0.5, 0, 0.1));
  EXPECT_EQ(s.tag.extra[1].size_m, 0.16) << "default: size of the first tag";
  EXPECT_FALSE(s.tag.extra[1].T_tag_extra);
  EXPECT_NE(error_with("specular = 1.0\n", "specular = 1.0\n" + extra + "7\n").find("id: found 7 twice"),
            std::string::npos);
  EXPECT_NE(error_with("specular = 1.0\n", "specular = 1.0\n" + extra + "2\n").find("id: found 2 twice"),
            std::string::npos);
}

TEST_F(SessionFile, FormerNamesOfExtraTagsAreReadWithOneWarningEach) {
  const auto with_former_names = [](std::string text) {
    for (std::size_t at = 0; (at = text.find("extra", at)) != std::string::npos;) {
      text.replace(at, std::string("extra").size(), "also");
    }
    return text;
  };
  const ConfigTable root = ConfigTable::parse(kCompleteSession + with_former_names(kExtraTags) +
                                                  "9\nT_tag_also = [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], "
                                                  "[0, 0, 0, 1]]\n",
                                              (folder_ / "session.toml").string());
  const Session s = read_session(root);
  root.finish();
  ASSERT_EQ(s.tag.extra.size(), 2u);
  EXPECT_EQ(s.tag.extra[0].id, 7);
  EXPECT_TRUE(s.tag.extra[0].T_tag_extra && s.tag.extra[1].T_tag_extra);
  ASSERT_EQ(root.warnings().size(), 2u);
  EXPECT_NE(root.warnings()[0].find("tag.also: is now named extra"), std::string::npos) << root.warnings()[0];
  EXPECT_NE(root.warnings()[1].find("tag.also.0.T_tag_also: is now named T_tag_extra"), std::string::npos)
      << root.warnings()[1];
  EXPECT_NE(error_with("specular = 1.0\n", "specular = 1.0\n[[tag.also]]\nid = 5\n[[tag.extra]]\nid = 6\n")
                .find("tag.also: found it together with its new name extra"),
            std::string::npos);
}

TEST_F(SessionFile, LampsWithTags) {
  const std::string lamp = R"([[lamp]]
tag_id = 7
tag_size_m = 0.06
position_m = [0.0, -0.05, 0.02]
radius_m = 0.03
)";
  std::ofstream(folder_ / "session.toml") << kCompleteSession + lamp +
                                                 "name = \"spot\"\nnormal = [0, -0.9, 0]\nintensity = [3, 2.5, 2]\n" +
                                                 lamp.substr(0, lamp.find('7')) + "8" + lamp.substr(lamp.find('7') + 1);
  const Session s = read();
  ASSERT_EQ(s.lamps.size(), 2u);
  EXPECT_EQ(s.lamps[0].name, "spot");
  EXPECT_EQ(s.lamps[0].tag_id, 7);
  EXPECT_EQ(s.lamps[0].tag_size_m, 0.06);
  EXPECT_EQ(s.lamps[0].position_m, Eigen::Vector3d(0, -0.05, 0.02));
  EXPECT_EQ(s.lamps[0].radius_m, 0.03);
  ASSERT_TRUE(s.lamps[0].normal && s.lamps[0].intensity);
  EXPECT_EQ(*s.lamps[0].normal, Eigen::Vector3d(0, -1, 0));
  EXPECT_EQ(*s.lamps[0].intensity, Eigen::Vector3f(3, 2.5f, 2));
  EXPECT_EQ(s.lamps[1].name, "with tag 8");
  EXPECT_FALSE(s.lamps[1].normal || s.lamps[1].intensity);

  const auto error = [&](const std::string& piece, const std::string& wrong) {
    std::string bad = lamp;
    bad.replace(bad.find(piece), piece.size(), wrong);
    return error_with("specular = 1.0\n", "specular = 1.0\n" + bad);
  };
  for (const auto& [piece, wrong, said] : {
           std::tuple("tag_id = 7", "tag_id = 2", "lamp.0.tag_id: found 2 twice, allowed: each tag once"),
           std::tuple("tag_id = 7", "tag_id = 587", "lamp.0.tag_id: found 587"),
           std::tuple("tag_id = 7\n", "", "lamp.0.tag_id"),
           std::tuple("0.06", "60", "lamp.0.tag_size_m: found 60"),
           std::tuple("[0.0, -0.05, 0.02]", "[0, -50, 20]", "lamp.0.position_m: found -50"),
           std::tuple("[0.0, -0.05, 0.02]", "[0, 1]", "lamp.0.position_m"),
           std::tuple("0.03", "0", "lamp.0.radius_m: found 0"),
           std::tuple("radius_m = 0.03", "radius_m = 0.03\nnormal = [0, 0, 0.1]", "lamp.0.normal: found a vector"),
           std::tuple("radius_m = 0.03", "radius_m = 0.03\nintensity = [-1, 0, 0]", "lamp.0.intensity: found -1"),
           std::tuple("radius_m = 0.03", "radius_m = 0.03\nintensity = [0, 0, 0]", "lamp.0.intensity: found none"),
           std::tuple("radius_m = 0.03", "radius_m = 0.03\ncolour = 3", "colour"),
       }) {
    const std::string text = error(piece, wrong);
    EXPECT_NE(text.find(said), std::string::npos) << wrong << ": " << text;
  }
}

TEST_F(SessionFile, DepthAndFisheyeAreOptional) {
  const std::string text = kCompleteSession;
  std::ofstream(folder_ / "session.toml") << text.substr(0, text.find("[depth]")) + text.substr(text.find("[tag]"));
  const Session s = read();
  EXPECT_FALSE(s.depth);
  EXPECT_FALSE(s.fisheye);
}

TEST_F(SessionFile, KannalaBrandt) {
  const Session s =
      read({"fisheye={source=\"images:f.txt\", width=10, height=20, model=\"kannala-brandt\", fx=3, fy=4, "
            "cx=5, cy=6, k=[0.1, 0.01, 0, 0], fov_degrees=180, exposure=1, response=\"srgb\", "
            "T_tag_fisheye=[[1,0,0,0],[0,1,0,0],[0,0,1,0],[0,0,0,1]]}"});
  EXPECT_EQ(s.fisheye->model.kind, CameraModel::Kind::kannala_brandt);
  EXPECT_EQ(s.fisheye->model.fy, 4.0);
  EXPECT_EQ(s.fisheye->model.k[1], 0.01);
}

TEST_F(SessionFile, ImplausibleVignettingIsRefused) {
  EXPECT_TRUE(read().fisheye->vignetting.none());
  EXPECT_EQ(read().fisheye->time_offset_s, 0.0);
  EXPECT_EQ(read({"fisheye.vignetting=[-0.3, 0, 0]"}).fisheye->vignetting.terms[0], -0.3);
  const std::string dark = error({"fisheye.vignetting=[-2, 0, 0]"});
  EXPECT_NE(dark.find("fisheye.vignetting: found 0.01"), std::string::npos) << dark;
  EXPECT_NE(dark.find(" of the axis' light at 81 degrees from it, allowed: 0.02 to 2 all over the field"),
            std::string::npos)
      << dark;
  EXPECT_NE(error({"fisheye.vignetting=[0, 0.2, 0]"}).find("fisheye.vignetting: found 2.0"), std::string::npos);
  EXPECT_NE(error({"fisheye.vignetting=[0, 0.2]"}).find("fisheye.vignetting: found an array of 2"), std::string::npos);
  EXPECT_NE(error({"fisheye.time_offset_s=1.5"}).find("fisheye.time_offset_s: found 1.5"), std::string::npos);
}

TEST_F(SessionFile, ReadoutTime) {
  EXPECT_FALSE(read().color.readout_s);
  EXPECT_EQ(read({"color.readout_ms=0"}).color.readout_s, 0.0);
  EXPECT_DOUBLE_EQ(read({"color.readout_ms=-18.5"}).color.readout_s.value(), -0.0185) << "from the last row";
  EXPECT_NE(error({"color.readout_ms=1001"}).find("color.readout_ms: found 1001"), std::string::npos);
}

TEST_F(SessionFile, BadValuesAreRefusedWithTheirLine) {
  EXPECT_NE(error_with("format = 1", "format = 2").find("session.toml:1: format: found 2"), std::string::npos);
  EXPECT_NE(error_with("width = 640", "width = 0").find(":6: color.width: found 0"), std::string::npos);
  EXPECT_NE(error_with("fx = 525.0", "fx = nan").find(":8: color.fx: found nan"), std::string::npos);
  EXPECT_NE(error_with("exposure = 3.27", "exposure = 0").find(":13: color.exposure: found 0"), std::string::npos);
  EXPECT_NE(error_with("response = \"linear\"", "response = \"gamma\"").find(":14: color.response: found \"gamma\""),
            std::string::npos);
  EXPECT_NE(error_with("distortion = [0.1, 0.2, 0.3, 0.4, 0.5]", "distortion = [0]")
                .find("color.distortion: found an array of 1"),
            std::string::npos);
  EXPECT_NE(error_with("[0, -1, 0, 0.025]", "[0, -1, 0, nan]").find(":23: depth.T_color_depth: found nan"),
            std::string::npos);
  EXPECT_NE(error_with("[0, -1, 0, 0.025]", "[0, -2, 0, 0.025]")
                .find("depth.T_color_depth: found a 3x3 part that is not orthonormal"),
            std::string::npos);
  EXPECT_NE(error_with("registered = false", "registered = true").find("found an unknown key"), std::string::npos);
  EXPECT_NE(error_with("registered = false", "registered = false\nprinciple = \"sonar\"")
                .find(":19: depth.principle: found \"sonar\", allowed: \"structured-light\", \"time-of-flight\", "
                      "\"stereo\""),
            std::string::npos);
  EXPECT_NE(error_with("registered = false", "registered = false\nnoise_scale = 0").find("depth.noise_scale: found 0"),
            std::string::npos);
  EXPECT_NE(error_with("id = 2", "id = 587").find("tag.id: found 587"), std::string::npos);
  EXPECT_NE(error_with("family = \"tag36h11\"", "family = \"tag99\"").find("tag.family: found \"tag99\""),
            std::string::npos);
  EXPECT_NE(error_with("floor.ply", "none.ply").find("real_surface.0.mesh: found \"none.ply\""), std::string::npos);
  EXPECT_NE(error_with("[0.6, 0.5, 0.4]", "[0.6, 0.5, 1.4]").find("real_surface.0.base_color: found 1.4"),
            std::string::npos);
  EXPECT_NE(error_with("size_m = 0.16", "size_m = 0.16\nsize = 3").find("tag.size: found an unknown key"),
            std::string::npos);
  EXPECT_NE(error_with("[tag]", "[tags]").find("tag: found nothing"), std::string::npos);
  EXPECT_NE(error_with("model = \"equidistant\"", "model = \"fov\"")
                .find("fisheye.model: found \"fov\", allowed: \"equidistant\", \"kannala-brandt\""),
            std::string::npos);
  EXPECT_NE(error_with("model = \"equidistant\"\nf = 154.4",
                       "model = \"kannala-brandt\"\nfx = 100\nfy = 100\nk = [-0.3, 0, 0, 0]")
                .find("fisheye.k: found a polynomial that turns back"),
            std::string::npos);
}

TEST_F(SessionFile, UnknownSourcesListTheKnownOnes) {
  for (const char* uri : {"theremin:0", "color.txt", "images:", ""}) {
    const std::string what = error({"color.source=\"" + std::string(uri) + "\""});
    EXPECT_NE(what.find("--set color.source: found \"" + std::string(uri) + "\", allowed"), std::string::npos) << what;
  }
  EXPECT_NE(
      error({"color.source=theremin:"}).find("images:LIST, mkv:FILE, oni:FILE, openni2:, v4l2:, libcamera:, aravis:"),
      std::string::npos);
}

}  // namespace
}  // namespace lumigraft::capture
