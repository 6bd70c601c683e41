// Limits of lamp extraction: clipping, neighbouring lamps, the horizon, a hand over the lens, near lamps.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "reconstruct/albedo/albedo.h"
#include "reconstruct/light/split.h"
#include "tests/reconstruct/albedo/albedo_room.h"
#include "tests/reconstruct/light/light_views.h"
#include "tests/sweeps/sweep.h"

namespace lumigraft::test {
namespace {

using Eigen::Vector3f;

const Vector3f kDim(0.1f, 0.12f, 0.15f);  ///< radiance of the surroundings
constexpr int kUsualSize = 512;           ///< pixels across 190°: 2.7 per degree

struct Disk {
  Vector3f direction, radiance;
  double radius_degrees;

  Vector3f irradiance() const { return (radiance - kDim) * static_cast<float>(reconstruct::disk_sr(radius_degrees)); }
};

capture::Image<float> picture_of(const capture::FisheyeCamera& camera, const std::vector<Disk>& disks) {
  return reconstruct::render(camera, [&](const Vector3f& d) -> Vector3f {
    for (const Disk& disk : disks) {
      if (reconstruct::within(d, disk.direction, disk.radius_degrees)) return disk.radiance;
    }
    return kDim;
  });
}

reconstruct::LightSplit split_of(const capture::FisheyeCamera& camera, const std::vector<Disk>& disks) {
  const capture::Image<float> picture = picture_of(camera, disks);
  return reconstruct::split_lamps(picture, capture::Image<std::uint8_t>(picture.width, picture.height, 1, 0),
                                  reconstruct::fisheye_view(camera), 8);
}

/// The lamp nearest to a disk; null where there is none within ten degrees.
const reconstruct::SplitLamp* nearest_to(const Disk& disk, const std::vector<reconstruct::SplitLamp>& lamps) {
  const reconstruct::SplitLamp* best = nullptr;
  for (const reconstruct::SplitLamp& lamp : lamps) {
    const double angle = reconstruct::angle_degrees(lamp.direction, disk.direction);
    if (angle < (best ? reconstruct::angle_degrees(best->direction, disk.direction) : 10)) best = &lamp;
  }
  return best;
}

double percent_off(const Vector3f& found, const Vector3f& truth) { return 100 * (found.sum() / truth.sum() - 1); }

TEST(LightSweep, Separation) {
  Sweep sweep{.stem = "light-separation",
              .title = "Two lamps, the second a third as bright; fish-eye of 512 pixels",
              .x_label = "degrees between their middles",
              .y_label = "off: degrees; irradiance, tenths",
              .x = {2, 3, 4, 6, 9, 13, 20, 28, 40},
              .curves = {{"direction, degrees"}, {"both, tenths"}, {"weaker, tenths"}},
              .logarithmic = true};
  const capture::FisheyeCamera camera = reconstruct::fisheye(190, kUsualSize);
  for (const double apart : sweep.x) {
    const double radius = std::min(2.0, 0.3 * apart);
    const Disk strong{reconstruct::towards(30, 0), Vector3f::Constant(30), radius},
        weak{reconstruct::towards(30 + apart, 0), {10, 10, 10}, radius};
    const reconstruct::LightSplit split = split_of(camera, {strong, weak});
    EXPECT_LE(split.lamps.size(), 2u) << apart << ": no lamps that are none";
    Vector3f sum = Vector3f::Zero();
    for (const reconstruct::SplitLamp& lamp : split.lamps) sum += lamp.irradiance;
    // If they are found as one lamp it represents both: the direction is off by the angle to the farther one.
    double worse = 0;
    for (const Disk& disk : {strong, weak}) {
      const reconstruct::SplitLamp* const lamp = nearest_to(disk, split.lamps);
      ASSERT_TRUE(lamp) << apart;
      worse = std::max(worse, reconstruct::angle_degrees(lamp->direction, disk.direction));
    }
    const double both = 0.1 * std::abs(percent_off(sum, strong.irradiance() + weak.irradiance()));
    const bool two = split.lamps.size() == 2;
    const double weaker =
        two ? 0.1 * std::abs(percent_off(nearest_to(weak, split.lamps)->irradiance, weak.irradiance())) : 10;
    sweep.curves[0].y.push_back(worse);
    sweep.curves[1].y.push_back(both);
    sweep.curves[2].y.push_back(weaker);
    if (apart < 3)
      continue;  // blurred lamps of 0.6° that touch are merged; the rest of their light stays in the residual
    EXPECT_LT(both, 0.3) << apart;
    EXPECT_TRUE(two) << apart;
    EXPECT_LT(worse, 0.5) << apart;
    EXPECT_LT(weaker, 0.5) << apart;
  }
  write_sweep(sweep);
}

TEST(LightSweep, Elevation) {
  Sweep sweep{.stem = "light-elevation",
              .title = "A lamp 6 degrees wide; the fish-eye sees to 5 degrees below the horizon",
              .x_label = "elevation, degrees",
              .y_label = "off the truth",
              .x = {-8, -6, -4, -2, 0, 2, 5, 10, 15, 30, 60, 85},
              .curves = {{"direction, degrees"}, {"irradiance, tenths"}}};
  const capture::FisheyeCamera camera = reconstruct::fisheye(190, kUsualSize);
  const reconstruct::FisheyeView view = reconstruct::fisheye_view(camera);
  for (const double elevation : sweep.x) {
    const Disk disk{reconstruct::towards(90 - elevation, 140), {40, 30, 20}, 3};
    const capture::Image<float> picture = picture_of(camera, {disk});
    const reconstruct::LightSplit split =
        reconstruct::split_lamps(picture, capture::Image<std::uint8_t>(kUsualSize, kUsualSize, 1, 0), view, 8);
    ASSERT_LE(split.lamps.size(), 1u);
    Vector3f seen = Vector3f::Zero();  // visible part of its energy: the lens ends 5° below the horizon
    for (std::size_t i = 0; i < view.direction.size(); ++i) {
      if (!view.sees(i)) continue;
      seen += (Eigen::Map<const Vector3f>(&picture.data[3 * i]) - kDim).cwiseMax(0.0f) * view.solid_angle_sr[i];
    }
    const bool found = !split.lamps.empty();
    const double direction = found ? reconstruct::angle_degrees(split.lamps[0].direction, disk.direction) : 0;
    const double irradiance = found ? 0.1 * std::abs(percent_off(split.lamps[0].irradiance, seen)) : 0;
    sweep.curves[0].y.push_back(direction);
    sweep.curves[1].y.push_back(irradiance);
    if (elevation >= -6) {
      EXPECT_TRUE(found) << elevation;
    }
    // A lamp cut by the border of the field of view is located by its visible part.
    EXPECT_LT(direction, elevation > -2 ? 0.1 : 4) << elevation;
    EXPECT_LT(irradiance, 0.2) << elevation;
  }
  write_sweep(sweep);
}

TEST(LightSweep, CoveredLamp) {
  constexpr int kPictures = 20, kFrom = 5;
  Sweep sweep{.stem = "light-covered",
              .title = "A lamp that something covers from the sixth picture on",
              .x_label = "picture",
              .y_label = "the lamp's irradiance over the truth before",
              .x = {},
              .curves = {{"for one picture"}, {"for four pictures"}, {"for good"}},
              .min = -1e-6,
              .max = 1 + 1e-6};
  capture::Session session;
  session.fisheye = reconstruct::fisheye(190, 256);
  const Disk covered{reconstruct::towards(35, 0), Vector3f::Constant(30), 4},
      other{reconstruct::towards(50, 200), Vector3f::Constant(20), 4};
  const auto frame_with = [&](const std::vector<Disk>& disks) {
    capture::FrameSet frame;
    auto picture = std::make_shared<capture::Frame>();
    picture->stream = capture::Stream::fisheye;
    picture->radiance = picture_of(*session.fisheye, disks);
    frame.fisheye.push_back(picture);
    return frame;
  };
  const Disk hand{covered.direction, Vector3f::Constant(0.02f), 12};
  const capture::FrameSet open = frame_with({covered, other}), hidden = frame_with({hand, other});
  for (int i = 0; i < kPictures; ++i) sweep.x.push_back(i);
  for (const int pictures : {1, 4, kPictures}) {
    Curve& curve = sweep.curves[pictures == 1 ? 0 : pictures == 4 ? 1 : 2];
    reconstruct::LightStage stage(session);
    int id = -1;
    for (int i = 0; i < kPictures; ++i) {
      const auto result = stage.extract(i >= kFrom && i < kFrom + pictures ? hidden : open);
      const int covered_for = i >= kFrom && i < kFrom + pictures ? i - kFrom + 1 : 0;
      double now = 0;
      for (const reconstruct::PointLight& light : result.illumination->lights) {
        if (reconstruct::angle_degrees(light.direction, covered.direction) > 1) continue;
        now += light.irradiance.sum() / covered.irradiance().sum();
        EXPECT_TRUE(id < 0 || id == light.id) << "another name at picture " << i;
        id = light.id;
        EXPECT_EQ(light.hidden > 0, !result.warnings.empty());
      }
      curve.y.push_back(now);
      // Kept for three pictures, then faded out in four equal steps.
      EXPECT_NEAR(now, std::clamp(1 - (covered_for - 3) / 4.0, 0.0, 1.0), 0.02) << i;
    }
  }
  write_sweep(sweep);
}

/// A room with a floor, a box, and the tag's paper at the origin.
reconstruct::TestRoom room_with_tag() {
  reconstruct::TestRoom room;
  room.half_m = 0.7f;
  room.ambient = Vector3f::Constant(0.06f);
  room.boxes = {{{0.05f, 0.1f, 0.0f}, {0.15f, 0.25f, 0.15f}}};
  room.albedo = [](const Vector3f& p) {
    const bool paper = std::abs(p.x()) < 0.1f && std::abs(p.y()) < 0.1f && p.z() < 0.01f;
    const bool black = (static_cast<int>(std::floor(p.x() / 0.04f)) + static_cast<int>(std::floor(p.y() / 0.04f))) % 2;
    return paper ? Vector3f(Vector3f::Constant(black ? 0.04f : 0.8f)) : Vector3f(0.3f, 0.25f, 0.2f);
  };
  return room;
}

TEST(LightSweep, PowerPastSaturation) {
  Sweep sweep{.stem = "light-power",
              .title = "A lamp brighter than the fish-eye picture can tell",
              .x_label = "lamp's radiance over the picture's end",
              .y_label = "irradiance over the truth",
              .x = {0.5, 1, 2, 4, 32, 256, 1024},
              .curves = {{"as it is read"}, {"found"}, {"brighter sky"}},
              .logarithmic = true,
              .min = 0.85,
              .max = 1.15};
  for (const double over : sweep.x) {
    for (const bool bright_sky : {false, true}) {
      reconstruct::TestRoom room = room_with_tag();
      room.lamps = {{{0.4f, -0.5f, 0.9f}, {1.2f, 1.0f, 0.8f}, 0.04f}};
      if (bright_sky) room.ambient *= 3;
      reconstruct::Illumination seen = room.illumination();
      const Vector3f truth = seen.lights[0].irradiance;
      // All channels clip at the same radiance.
      const float end = truth.y() / static_cast<float>(over);
      seen.lights[0].irradiance = truth.cwiseMin(end);
      seen.lights[0].clipped = truth.maxCoeff() > end;
      capture::Session session;
      const auto result = reconstruct::AlbedoStage(session).solve(room.field(), seen);
      ASSERT_EQ(result.illumination->lights.size(), 1u);
      const reconstruct::PointLight& light = result.illumination->lights[0];
      const double ratio = light.irradiance.sum() / truth.sum();
      if (!bright_sky) sweep.curves[0].y.push_back(seen.lights[0].irradiance.sum() / truth.sum());
      sweep.curves[bright_sky ? 2 : 1].y.push_back(ratio);
      EXPECT_GT(ratio, sweep.min) << over;
      EXPECT_LT(ratio, sweep.max) << over;
      EXPECT_EQ(light.clipped, seen.lights[0].clipped) << "its power stays marked as found otherwise";
    }
  }
  write_sweep(sweep);
}

TEST(LightSweep, Distance) {
  Sweep sweep{.stem = "light-distance",
              .title = "A lamp 50 degrees up; an object 0.4 m from the fish-eye",
              .x_label = "lamp's distance from the fish-eye, m",
              .y_label = "off at the object",
              .x = {0.5, 0.7, 1, 1.5, 2, 4, 6, 8, 10},
              .curves = {{"direction, degrees"}, {"irradiance, tenths"}, {"were it far, degrees", {}, true}},
              .logarithmic = true};
  for (const double distance : sweep.x) {
    reconstruct::TestRoom room = room_with_tag();
    const Vector3f towards_lamp = reconstruct::towards(40, -50);
    reconstruct::TestLamp lamp{room.probe + static_cast<float>(distance) * towards_lamp,
                               Vector3f(1.2f, 1.0f, 0.8f) * static_cast<float>(distance * distance),
                               0.03f * static_cast<float>(distance)};
    room.lamps = {lamp};
    const auto result = reconstruct::AlbedoStage(capture::Session()).solve(room.field(), room.illumination());
    ASSERT_EQ(result.illumination->lights.size(), 1u);
    const reconstruct::PointLight& light = result.illumination->lights[0];
    const Vector3f object(0.15f, 0.2f, 0.1f);
    const Vector3f true_way = lamp.position - object;
    const Vector3f way = light.distance_known ? Vector3f(light.position_m - object) : light.direction;
    const Vector3f irradiance = light.distance_known ? Vector3f(light.intensity / way.squaredNorm()) : light.irradiance;
    const double direction = reconstruct::angle_degrees(way, true_way);
    const double ratio = 0.1 * std::abs(percent_off(irradiance, lamp.intensity / true_way.squaredNorm()));
    sweep.curves[0].y.push_back(direction);
    sweep.curves[1].y.push_back(ratio);
    sweep.curves[2].y.push_back(reconstruct::angle_degrees(towards_lamp, true_way));
    const bool found = light.distance_known;
    EXPECT_TRUE(found || distance > 7) << distance;
    EXPECT_LT(direction, found ? 0.3 : 3) << distance;
    EXPECT_LT(ratio, found ? 0.1 : 0.5) << distance;
    // A lamp treated as infinitely distant causes a warning.
    EXPECT_EQ(light.distance_known, result.warnings.empty()) << distance;
  }
  write_sweep(sweep);
}

}  // namespace
}  // namespace lumigraft::test
