// A real exposure bracket of an office through a circular fish-eye, merged to absolute radiance. LUMIGRAFT_EXTRA names
// a folder with data/office-fisheye: five of the exposures, the camera's response, the lens's fall-off.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <numbers>
#include <sstream>

#include "capture/camera/radiance.h"
#include "reconstruct/calibrate/pictures.h"
#include "reconstruct/light/environment.h"
#include "reconstruct/light/light.h"
#include "tests/capture/scratch_folder.h"
#include "tests/reconstruct/real_data.h"

namespace lumigraft::reconstruct {
namespace {

// The square of the photograph that the fish-eye's 180° fill (from its notes); every fourth pixel is used.
constexpr int kLeft = 1019, kTop = 3744 - 74 - 3612, kDiameter = 3612, kStep = 4, kSize = kDiameter / kStep;
constexpr std::array kExposures = {std::pair{"IMG_6955", 13.0}, std::pair{"IMG_6959", 0.8}, std::pair{"IMG_6963", 0.05},
                                   std::pair{"IMG_6967", 1 / 320.0}, std::pair{"IMG_6971", 1 / 5000.0}};  // seconds
constexpr double kAperture = 5.6, kIso = 100;
// Saturation luminance is K N² / (t S), ISO 12232, with K = 87 cd s/m² as in the program that determined the second
// number, the photometric factor of this lens at f/5.6.
constexpr double kK = 87, kPhotometric = 1.18;
constexpr double kReferenceLux = 900.94;  ///< from all 18 exposures, stated by the data's source

double fall_off(double r) { return 1 + 0.1755458928191 * r * r - 0.528613562104476 * r * r * r * r; }
double luminance(const float* rgb) { return 0.265 * rgb[0] + 0.670 * rgb[1] + 0.065 * rgb[2]; }

/// Equisolid angle, r = 2 f sin(θ/2), as a Kannala-Brandt series; its next term is 2e-6 of θ at 90°.
capture::CameraModel lens() {
  capture::CameraModel camera;
  camera.kind = capture::CameraModel::Kind::kannala_brandt;
  camera.width = camera.height = kSize;
  camera.fx = camera.fy = kSize / 2.0 / (2 * std::sin(std::numbers::pi / 4));
  camera.cx = camera.cy = kSize / 2.0 - 0.5;
  camera.k = {-1.0 / 24, 1.0 / 1920, -1.0 / 322560, 1.0 / 92897280};
  camera.fov_rad = std::numbers::pi;
  return camera;
}

std::shared_ptr<capture::Frame> photograph(const std::filesystem::path& file, double seconds) {
  const capture::Frame photo = read_any_picture(file);
  auto picture = std::make_shared<capture::Frame>();
  picture->stream = capture::Stream::fisheye;
  picture->exposure = seconds * kIso / (kK * kAperture * kAperture);  // of luminance, cd/m²
  picture->encoded = capture::Image<std::uint8_t>(kSize, kSize, 3);
  for (int v = 0; v < kSize; ++v)
    for (int u = 0; u < kSize; ++u)
      for (int c = 0; c < 3; ++c)
        picture->encoded.at(u, v, c) = photo.encoded.at(kLeft + kStep * u + 2, kTop + kStep * v + 2, c);
  return picture;
}

/// `polynomials`: of the pixel value over 255, highest power first, one line per channel.
capture::Response response_of(const std::filesystem::path& polynomials, const std::filesystem::path& table) {
  std::ifstream in(polynomials);
  std::array<std::array<double, 5>, 3> of{};
  for (auto& channel : of) {
    int degree = 0;
    in >> degree;
    for (double& factor : channel) in >> factor;
  }
  std::ofstream out(table);
  for (int code = 0; code < 256; ++code) {
    for (const auto& channel : of) {
      double value = 0;
      for (const double factor : channel) value = value * code / 255 + factor;
      out << std::clamp(value, 0.0, 1.0) << " ";
    }
    out << "\n";
  }
  out.close();
  return capture::Response::from_file(table);
}

/// Removes the lens's fall-off and applies the photometric factor.
void correct(capture::Image<float>& radiance, const FisheyeView& view) {
  for (std::size_t i = 0; i < view.direction.size(); ++i) {
    if (!view.sees(i)) continue;
    const double r = std::acos(std::clamp(view.direction[i].z(), -1.0f, 1.0f)) / (std::numbers::pi / 2);
    for (int c = 0; c < 3; ++c) radiance.data[3 * i + c] *= static_cast<float>(kPhotometric / fall_off(r));
  }
}

/// Of a plane orthogonal to the optical axis, lx.
double illuminance(const capture::Image<float>& radiance, const FisheyeView& view) {
  double lux = 0;
  for (std::size_t i = 0; i < view.direction.size(); ++i)
    if (view.sees(i)) lux += luminance(&radiance.data[3 * i]) * view.direction[i].z() * view.solid_angle_sr[i];
  return lux;
}

using LightBracket = test::ScratchFolder;

TEST_F(LightBracket, AnOfficeInLux) {
  const auto folder = test::data_folder("office-fisheye");
  if (!folder) GTEST_SKIP() << "LUMIGRAFT_EXTRA names no folder with data/office-fisheye";
  const capture::Response response =
      response_of(*folder / "response_function_files/Response_function.rsp", folder_ / "table");
  capture::Session session;
  session.fisheye.emplace();
  session.fisheye->model = lens();
  session.fisheye->response = response;
  const FisheyeView view = fisheye_view(*session.fisheye);
  std::vector<std::shared_ptr<const capture::Frame>> bracket;
  for (const auto& [name, seconds] : kExposures)
    bracket.push_back(photograph(*folder / "JPEG" / (std::string(name) + ".JPG"), seconds));

  capture::RadianceImage merged = capture::merge_bracket(bracket, response);
  correct(merged.radiance, view);
  const double lux = illuminance(merged.radiance, view);
  float brightest = 0;
  for (std::size_t i = 0; i < view.direction.size(); ++i)
    if (view.sees(i)) brightest = std::max(brightest, static_cast<float>(luminance(&merged.radiance.data[3 * i])));
  std::printf("office: %.0f lx (reference %.0f), brightest %.0f cd/m², %.4f %% of pixels clipped\n", lux, kReferenceLux,
              brightest, 100 * merged.clipped_fraction);
  EXPECT_NEAR(lux / kReferenceLux, 1, 0.05);
  EXPECT_LT(merged.clipped_fraction, 0.001);

  // Each exposure alone agrees with the merged image where it is in range, and none is needed if the others cover it.
  for (std::size_t i = 0; i < bracket.size(); ++i) {
    capture::RadianceImage alone = capture::to_radiance(*bracket[i], response);
    correct(alone.radiance, view);
    std::vector<double> ratio;
    for (std::size_t p = 0; p < view.direction.size(); ++p) {
      const auto* const code = &bracket[i]->encoded.data[3 * p];
      if (view.sees(p) && *std::min_element(code, code + 3) > 60 && *std::max_element(code, code + 3) < 220)
        ratio.push_back(luminance(&alone.radiance.data[3 * p]) / luminance(&merged.radiance.data[3 * p]));
    }
    std::vector<std::shared_ptr<const capture::Frame>> others = bracket;
    others.erase(others.begin() + static_cast<std::ptrdiff_t>(i));
    capture::RadianceImage without = capture::merge_bracket(others, response);
    correct(without.radiance, view);
    std::sort(ratio.begin(), ratio.end());
    const double middle = ratio.empty() ? 0 : ratio[ratio.size() / 2];
    const double lux_without = illuminance(without.radiance, view);
    std::printf("    %8.4f s: %6zu pixels in range, %.3f of the merged in the median; without it %.0f lx\n",
                kExposures[i].second, ratio.size(), middle, lux_without);
    EXPECT_NEAR(lux_without / lux, 1, 0.06);
    if (ratio.size() > 1000) {
      EXPECT_NEAR(middle, 1, 0.06);
    }
  }

  LightStage stage(session);
  capture::FrameSet frame;
  frame.fisheye = bracket;
  const auto light = stage.extract(frame).illumination;
  ASSERT_TRUE(light);
  EXPECT_GE(light->lights.size(), 3u) << "windows";
  for (const PointLight& lamp : light->lights)
    std::printf("    lamp at (%.2f %.2f %.2f), %.0f lx facing it, %.1f deg wide\n", lamp.direction.x(),
                lamp.direction.y(), lamp.direction.z(), luminance(lamp.irradiance.data()),
                2 * lamp.angular_radius_rad * 180 / std::numbers::pi);
}

}  // namespace
}  // namespace lumigraft::reconstruct
