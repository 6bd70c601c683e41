// `--oracle light` with an environment picture.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <numbers>

#include "capture/camera/srgb.h"
#include "capture/formats/picture_writer.h"
#include "reconstruct/light/environment.h"
#include "server/truth/oracle.h"
#include "tests/reconstruct/light/light_views.h"

namespace lumigraft::server {
namespace {

constexpr int kWidth = 720, kHeight = 360;
constexpr float kSky = 0.8f, kGround = 0.3f;

/// A session on open ground under a uniform sky and a sun, with truth/environment.exr.
class SunAndSky : public testing::Test {
 protected:
  SunAndSky() : folder_(std::filesystem::path(testing::TempDir()) / ("lumigraft-sun-" + std::to_string(getpid()))) {
    std::filesystem::create_directories(folder_ / "truth/000000");
    std::ofstream(folder_ / "truth/000000/lights.json")
        << R"({"lights": [], "environment": {"file": "environment.exr"}})";
    std::ofstream(folder_ / "truth/real_scene.ply")
        << "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
           "element face 1\nproperty list uchar int vertex_indices\nend_header\n-9 -9 0\n9 -9 0\n9 9 0\n-9 9 0\n"
           "4 0 1 2 3\n";
    session_.folder = folder_;
    session_.name = "sun-and-sky";
    session_.fisheye = reconstruct::fisheye(190, 300);
    session_.fisheye->T_tag_fisheye.translation() = Eigen::Vector3d(0, 0, 0.05);
    session_.fisheye->exposure = 0.5;
  }
  ~SunAndSky() override { std::filesystem::remove_all(folder_); }

  /// Sets one texel to the sun; `irradiance` on a surface that faces it, W/m².
  void shine(const Eigen::Vector3f& towards_sun, float irradiance) {
    environment_.radiance = capture::Image<float>(kWidth, kHeight, 3);
    std::pair<int, int> sun;
    float nearest = -1;
    for (int v = 0; v < kHeight; ++v) {
      for (int u = 0; u < kWidth; ++u) {
        const Eigen::Vector3f w = reconstruct::environment_direction(u, v, kWidth, kHeight);
        for (int c = 0; c < 3; ++c) environment_.radiance.at(u, v, c) = w.z() > 0 ? kSky : 0;
        if (w.dot(towards_sun) > nearest) {
          nearest = w.dot(towards_sun);
          sun = {u, v};
        }
      }
    }
    sun_ = reconstruct::environment_direction(sun.first, sun.second, kWidth, kHeight);
    irradiance_ = irradiance;
    for (int c = 0; c < 3; ++c) {
      environment_.radiance.at(sun.first, sun.second, c) +=
          irradiance / reconstruct::environment_solid_angle_sr(sun.second, kWidth, kHeight);
    }
    capture::write_exr(folder_ / "truth/environment.exr", environment_.radiance);
  }

  /// The fish-eye's picture, linear.
  capture::Image<float> seen() const {
    return reconstruct::render(*session_.fisheye, [&](const Eigen::Vector3f& w) {
      return w.z() > 0 ? environment_.sample(w) : Eigen::Vector3f::Constant(kGround).eval();
    });
  }

  /// A frame of 8-bit pictures: only the sun exceeds their range.
  capture::FrameSet frame() const {
    const capture::Image<float> radiance = seen();
    auto picture = std::make_shared<capture::Frame>();
    picture->stream = capture::Stream::fisheye;
    picture->exposure = session_.fisheye->exposure;
    picture->encoded = capture::Image<std::uint8_t>(radiance.width, radiance.height, 3);
    for (std::size_t i = 0; i < radiance.data.size(); ++i) {
      const float shown = std::min(static_cast<float>(picture->exposure) * radiance.data[i], 1.0f);
      picture->encoded.data[i] = static_cast<std::uint8_t>(std::lround(255 * capture::linear_to_srgb(shown)));
    }
    capture::FrameSet frame;
    frame.fisheye = {picture};
    return frame;
  }

  /// Expects the sun as a lamp, and no other source as bright.
  void expect_sun(const reconstruct::Illumination& light) const {
    ASSERT_FALSE(light.lights.empty());
    const reconstruct::PointLight& lamp = light.lights[0];
    EXPECT_LT(reconstruct::angle_degrees(lamp.direction, sun_), 0.3);
    EXPECT_NEAR(lamp.irradiance.x() / irradiance_, 1, 0.05);
    EXPECT_LT(lamp.angular_radius_rad, 2 * reconstruct::kDegree);
    EXPECT_FALSE(lamp.distance_known);
    EXPECT_FALSE(lamp.clipped);
    for (std::size_t i = 1; i < light.lights.size(); ++i) EXPECT_LT(light.lights[i].irradiance.x(), 0.1f * irradiance_);
    const capture::Image<float>& rest = light.environment.radiance;
    EXPECT_LT(*std::max_element(rest.data.begin(), rest.data.end()), 2 * kSky);
  }

  std::shared_ptr<const reconstruct::Illumination> light() const {
    OracleParts parts;
    parts.light = true;
    return Oracle(session_, parts).illumination(frame());
  }

  std::filesystem::path folder_;
  capture::Session session_;
  reconstruct::EnvironmentMap environment_;
  Eigen::Vector3f sun_;
  float irradiance_ = 0;
};

TEST_F(SunAndSky, ATrueFisheyePictureHoldsTheSun) {
  shine(reconstruct::towards(50, 20), 6);
  capture::write_exr(folder_ / "truth/000000/fisheye.exr", seen());
  expect_sun(*light());
}

// Half precision ends at 65504 W/sr/m².
TEST_F(SunAndSky, ASunThatAFileCannotHoldIsAsStrongAsInTheEnvironment) {
  shine(reconstruct::towards(50, 20), 6);
  capture::Image<float> picture = seen();
  const float max_value = *std::max_element(picture.data.begin(), picture.data.end());
  for (float& value : picture.data) {
    if (value > 0.3f * max_value) value = std::numeric_limits<float>::infinity();
  }
  capture::write_exr(folder_ / "truth/000000/fisheye.exr", picture);
  expect_sun(*light());
}

TEST_F(SunAndSky, WithoutATrueFisheyePictureTheSunIsThatOfTheEnvironment) {
  shine(reconstruct::towards(50, 20), 6);
  expect_sun(*light());
}

TEST_F(SunAndSky, ASunBeyondTheFisheyesViewIsALampToo) {
  session_.fisheye = reconstruct::fisheye(100, 300);
  shine(reconstruct::towards(70, 20), 6);
  capture::write_exr(folder_ / "truth/000000/fisheye.exr", seen());
  expect_sun(*light());
}

}  // namespace
}  // namespace lumigraft::server
