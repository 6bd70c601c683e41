// Rooms with dozens of lamps, among them fluorescent tubes.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <optional>
#include <random>
#include <set>
#include <vector>

#include "capture/camera/srgb.h"
#include "reconstruct/light/environment.h"
#include "reconstruct/light/lamp_merge.h"
#include "reconstruct/light/light.h"
#include "reconstruct/light/parameters.h"
#include "reconstruct/light/split.h"
#include "tests/reconstruct/light/light_views.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Vector3f;

TEST(ManyLamps, AllOnADomeAreFound) {
  const capture::FisheyeCamera camera = fisheye(190, 512);
  const FisheyeView view = fisheye_view(camera);
  constexpr float kRoom = 0.1f;
  for (const int count : {1, 4, 16, 32}) {
    std::vector<Vector3f> lamps;
    for (int i = 0; i < count; ++i)  // golden-angle spiral down to 75° from the zenith
      lamps.push_back(towards(75 * std::sqrt((i + 0.5) / count), 137.50776 * i));
    const auto radiance = [&](int i) { return 20.0f + static_cast<float>(i); };
    const auto picture = render(camera, [&](const Vector3f& d) -> Vector3f {
      for (int i = 0; i < count; ++i)
        if (within(d, lamps[i], 1.5)) return Vector3f::Constant(radiance(i));
      return Vector3f::Constant(kRoom);
    });
    const LightSplit split = split_lamps(picture, unclipped(picture), view, kLightParameters.max_lights);
    ASSERT_EQ(split.lamps.size(), static_cast<std::size_t>(count));
    for (int i = 0; i < count; ++i) {
      const auto found = std::min_element(split.lamps.begin(), split.lamps.end(), [&](const auto& a, const auto& b) {
        return angle_degrees(a.direction, lamps[i]) < angle_degrees(b.direction, lamps[i]);
      });
      EXPECT_LT(angle_degrees(found->direction, lamps[i]), 0.1) << i << " of " << count;
      EXPECT_NEAR(found->irradiance.y() / ((radiance(i) - kRoom) * disk_sr(1.5)), 1, 0.03) << i << " of " << count;
    }
  }
}

/// Tubes of 1.2 m × 6 cm below a ceiling, in two rows along x; the probe is at the origin.
constexpr int kRows = 2, kTubes = 14;
constexpr float kCeiling_m = 2.2f, kHalfLength_m = 0.6f, kHalfWidth_m = 0.03f;
Vector3f tube(int i) { return {1.5f * static_cast<float>(i / kRows - 3), i % kRows ? 1.1f : -1.3f, kCeiling_m}; }

/// The tube that a ray hits, or -1.
int tube_at(const Vector3f& d) {
  if (d.z() <= 0) return -1;
  const Vector3f p = d * (kCeiling_m / d.z());
  for (int i = 0; i < kTubes; ++i) {
    const Vector3f q = (p - tube(i)).cwiseAbs();
    if (q.x() < kHalfLength_m && q.y() < kHalfWidth_m) return i;
  }
  return -1;
}

class Tubes : public testing::Test {
 protected:
  Tubes() {
    session_.fisheye = fisheye(190, 640);
    picture_ = render(*session_.fisheye, [](const Vector3f& d) -> Vector3f {
      return tube_at(d) >= 0 ? Vector3f(30, 34, 38) : Vector3f::Constant(d.z() > 0 ? 0.3f : 0.1f);
    });
    const FisheyeView view = fisheye_view(*session_.fisheye);
    // Irradiance above the ceiling's, by the same pixels.
    for (std::size_t i = 0; i < view.direction.size(); ++i)
      if (view.sees(i) && picture_.data[3 * i] > 0.3f) energy_ += (picture_.data[3 * i] - 0.3) * view.solid_angle_sr[i];
  }

  /// The lamps of the next image, pieces of one merged; `noise`: 1σ, relative.
  std::vector<PointLight> see(double noise, float clip_at = 1e9f) {
    std::normal_distribution<double> normal(1, noise);
    auto frame = std::make_shared<capture::Frame>();
    frame->stream = capture::Stream::fisheye;
    if (clip_at < 1e9f) {
      frame->exposure = 1 / clip_at;
      frame->encoded = capture::Image<std::uint8_t>(picture_.width, picture_.height, 3);
      for (std::size_t i = 0; i < picture_.data.size(); ++i)
        frame->encoded.data[i] = static_cast<std::uint8_t>(std::lround(
            std::clamp(255 * capture::linear_to_srgb(static_cast<float>(normal(random_) * picture_.data[i] / clip_at)),
                       0.0f, 255.0f)));
    } else {
      frame->radiance = picture_;
      for (float& value : frame->radiance.data) value *= static_cast<float>(normal(random_));
    }
    return merge_pieces(stage_->extract({frame}, nullptr, {}).illumination->lights);
  }
  void SetUp() override { stage_.emplace(session_); }

  capture::Session session_;
  capture::Image<float> picture_;
  double energy_ = 0;  ///< of all tubes, first channel
  std::optional<LightStage> stage_;
  std::mt19937 random_{1};
};

/// The tubes that the lamps lie on, each once.
void expect_each_once(const std::vector<PointLight>& lamps) {
  std::set<int> found;
  for (const PointLight& lamp : lamps) found.insert(tube_at(lamp.direction));
  EXPECT_EQ(lamps.size(), static_cast<std::size_t>(kTubes));
  EXPECT_EQ(found.size(), static_cast<std::size_t>(kTubes));
  EXPECT_FALSE(found.contains(-1));
}

TEST_F(Tubes, EachIsFoundOnceWithItsEnergyAndKeepsItsIdentity) {
  std::map<int, int> ids;
  for (int i = 0; i < 6; ++i) {
    const std::vector<PointLight> lamps = see(0.05);
    expect_each_once(lamps);
    double sum = 0;
    for (const PointLight& lamp : lamps) {
      sum += lamp.irradiance.x();
      const auto [id, is_new] = ids.try_emplace(tube_at(lamp.direction), lamp.id);
      EXPECT_EQ(lamp.id, id->second) << "tube " << id->first << ", image " << i;
    }
    EXPECT_NEAR(sum / energy_, 1, 0.03) << i;
  }
}

TEST_F(Tubes, EachIsFoundOnceWhereTheyClip) { expect_each_once(see(0.02, 1)); }

}  // namespace
}  // namespace lumigraft::reconstruct
