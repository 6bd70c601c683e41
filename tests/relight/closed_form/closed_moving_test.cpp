// Slow motion: direct light follows at once, indirect light in cycles (amortized_light_update.h). Each picture is
// compared with that of a new relighter, which gathers everything at once.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "relight/amortized_light_update.h"
#include "relight/parameters.h"
#include "tests/relight/closed_form/closed_scene.h"
#include "tests/relight/gpu/limited_device.h"

namespace lumigraft::test {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

/// A room of 2 × 2 × 1 m that emits the sky of box_on_floor().
reconstruct::Scene closed(reconstruct::Scene scene) {
  reconstruct::Enclosure room;
  room.sides.push_back({{0, 0, 1}, 0, true});
  room.sides.push_back({{0, 0, -1}, 1, false});
  for (const float sign : {-1.0f, 1.0f}) {
    room.sides.push_back({{sign, 0, 0}, 1, false});
    room.sides.push_back({{0, sign, 0}, 1, false});
  }
  room.middle_m = {0, 0, 0.5f};
  scene.enclosure = std::make_shared<const reconstruct::Enclosure>(room);
  return scene;
}

relight::Exhibit turned(const relight::Exhibit& exhibit, double degrees) {
  relight::Exhibit result = exhibit;
  result.objects.front().rotation = Eigen::AngleAxisd(degrees * kDegree, Eigen::Vector3d::UnitZ());
  return result;
}

struct Unlike {
  double rms_codes = 0;
  int worst_codes = 0;
};
Unlike unlike(const capture::Image<std::uint8_t>& a, const capture::Image<std::uint8_t>& b) {
  Unlike result;
  for (std::size_t i = 0; i < a.data.size(); ++i) {
    const int codes = std::abs(a.data[i] - b.data[i]);
    result.rms_codes += codes * codes;
    result.worst_codes = std::max(result.worst_codes, codes);
  }
  result.rms_codes = std::sqrt(result.rms_codes / static_cast<double>(a.data.size()));
  return result;
}

class ClosedMoving : public ClosedTest {
 protected:
  capture::Image<std::uint8_t> at_once(const ClosedScene& scene, const reconstruct::Scene& now,
                                       const relight::Exhibit& exhibit) const {
    return relight::Relighter(device_, scene.session()).relight(scene.frame(), now, exhibit, live_plan()).srgb;
  }
  /// Static frames until all updates are finished.
  static capture::Image<std::uint8_t> settle(relight::Relighter& relighter, const capture::FrameSet& frame,
                                             const reconstruct::Scene& now, const relight::Exhibit& exhibit,
                                             int* frames) {
    for (*frames = 0; *frames < 4 * relight::kRelight.round_frames; ++*frames) {
      const relight::RelitPicture picture = relighter.relight(frame, now, exhibit, live_plan());
      if (picture.passes.empty()) return picture.srgb;
    }
    return {};
  }
};

// The update schedule does not depend on the device.
INSTANTIATE_TEST_SUITE_P(On, ClosedMoving, testing::Values(relight::gpu::Backend::vulkan));

// The box rotates by 1° per frame for two cycles: the pictures lag by a stated bound, and once it stops the picture
// becomes bitwise equal to the one gathered at once.
TEST_P(ClosedMoving, IndirectLightLagsAndComesToRestWhereItShould) {
  const ClosedScene scene = box_on_floor();
  const capture::FrameSet frame = scene.frame();
  const int last = 2 * relight::kRelight.round_frames;
  capture::Image<std::uint8_t> of_open_room;
  for (const reconstruct::Scene& now : {scene.scene(), closed(scene.scene())}) {
    relight::Relighter relighter(device_, scene.session());
    capture::Image<std::uint8_t> picture;
    for (int i = 0; i <= last; ++i) picture = relighter.relight(frame, now, turned(scene.exhibit, i), live_plan()).srgb;
    const capture::Image<std::uint8_t> wanted = at_once(scene, now, turned(scene.exhibit, last));
    const Unlike moving = unlike(picture, wanted);
    RecordProperty(now.enclosure ? "rms_codes_moving_in_closed_room" : "rms_codes_moving",
                   std::to_string(moving.rms_codes));
    EXPECT_GT(moving.rms_codes, 0) << "nothing lags: this test tests nothing";
    EXPECT_LT(moving.rms_codes, 1.0);
    int frames = 0;
    EXPECT_EQ(settle(relighter, frame, now, turned(scene.exhibit, last), &frames).data, wanted.data);
    EXPECT_LE(frames, 3 * relight::kRelight.round_frames + 1);
    EXPECT_NE(wanted.data, of_open_room.data) << "the enclosure changes nothing: this test tests nothing of it";
    of_open_room = wanted;
  }
}

// Jumps are not blended.
TEST_P(ClosedMoving, AJumpIsShownAtOnce) {
  const ClosedScene scene = box_on_floor();
  const capture::FrameSet frame = scene.frame();
  const reconstruct::Scene now = scene.scene();
  relight::Relighter relighter(device_, scene.session());
  for (int i = 0; i < 5; ++i) relighter.relight(frame, now, turned(scene.exhibit, i), live_plan());
  EXPECT_EQ(relighter.relight(frame, now, turned(scene.exhibit, 60), live_plan()).srgb.data,
            at_once(scene, now, turned(scene.exhibit, 60)).data);
  ClosedScene brighter = scene;
  brighter.lamps.front().intensity *= 2;
  brighter.lamps.front().irradiance *= 2;
  reconstruct::Scene after = now;
  after.illumination = brighter.scene().illumination;
  EXPECT_EQ(relighter.relight(frame, after, turned(scene.exhibit, 60), live_plan()).srgb.data,
            at_once(scene, after, turned(scene.exhibit, 60)).data);
}

// Without memory for a second set of volumes there are no cycles.
TEST_P(ClosedMoving, ADeviceWithoutRoomForRoundsGathersAtOnce) {
  const ClosedScene scene = box_on_floor();
  const capture::FrameSet frame = scene.frame();
  const reconstruct::Scene now = scene.scene();
  int rooms = 0;
  const auto small = std::make_shared<LimitedDevice>(
      device_, [&](const relight::gpu::TextureDesc& d) { return d.name != "real distance" || ++rooms < 2; });
  relight::Relighter relighter(small, scene.session());
  for (int i = 0; i < 3; ++i) {
    const relight::RelitPicture picture = relighter.relight(frame, now, turned(scene.exhibit, i), live_plan());
    EXPECT_EQ(picture.srgb.data, at_once(scene, now, turned(scene.exhibit, i)).data);
    EXPECT_EQ(picture.warnings.empty(), i == 0);
  }
  EXPECT_EQ(rooms, 2) << "tried once";
}

// The same without memory for the surface data of such a set.
TEST_P(ClosedMoving, ADeviceThatIsFullInTheMiddleOfARoundGathersAtOnce) {
  const ClosedScene scene = box_on_floor();
  const capture::FrameSet frame = scene.frame();
  const reconstruct::Scene now = scene.scene();
  int pools = 0;
  const auto small = std::make_shared<LimitedDevice>(
      device_, [&](const relight::gpu::TextureDesc& d) { return d.name != "virtual radiance" || ++pools < 2; });
  relight::Relighter relighter(small, scene.session());
  relight::RelitPicture picture;
  for (int i = 0; i < relight::kRelight.round_frames; ++i) {
    picture = relighter.relight(frame, now, turned(scene.exhibit, i), live_plan());
    EXPECT_EQ(picture.warnings.empty(), pools < 2);
    if (pools == 2) {
      EXPECT_EQ(picture.srgb.data, at_once(scene, now, turned(scene.exhibit, i)).data);
      if (i % 2) break;
    }
  }
  EXPECT_EQ(pools, 2) << "tried once";
}

// A ball rotates with its volumes and maps: nothing should change in the picture. Rotation changes facets and texels,
// so the change is bounded by their error. A lamp that moves by 1 mm per frame changes the picture by no more than with
// light gathered at once.
TEST_P(ClosedMoving, WhatShouldNotChangeStays) {
  ClosedScene scene = box_on_floor();
  scene.exhibit.objects = {sphere_object(0.1f, {0, 0, 0.12f}, 0.7f)};
  const capture::FrameSet frame = scene.frame();
  const reconstruct::Scene now = scene.scene();
  relight::Relighter relighter(device_, scene.session());
  const capture::Image<std::uint8_t> first = relighter.relight(frame, now, scene.exhibit, live_plan()).srgb;
  double worst_rms = 0;
  for (int i = 1; i <= 2 * relight::kRelight.round_frames; ++i) {
    const capture::Image<std::uint8_t> picture =
        relighter.relight(frame, now, turned(scene.exhibit, i), live_plan()).srgb;
    worst_rms = std::max(worst_rms, unlike(picture, first).rms_codes);
  }
  RecordProperty("rms_codes_turning", std::to_string(worst_rms));
  EXPECT_LT(worst_rms, 1.0);

  double worst_step = 0;
  capture::Image<std::uint8_t> before = first;
  reconstruct::Scene lit = now;
  for (int i = 1; i <= relight::kRelight.round_frames + 10; ++i) {
    ClosedScene moved = scene;
    moved.lamps.front().position_m.x() += 0.001f * static_cast<float>(i);
    lit.illumination = moved.scene().illumination;
    const capture::Image<std::uint8_t> picture = relighter.relight(frame, lit, scene.exhibit, live_plan()).srgb;
    if (i > 1) worst_step = std::max(worst_step, unlike(picture, before).rms_codes);
    before = picture;
  }
  RecordProperty("rms_codes_lamp", std::to_string(worst_step));
  EXPECT_LT(worst_step, 1.0) << "from one frame to the next";
  int frames = 0;
  EXPECT_EQ(settle(relighter, frame, lit, scene.exhibit, &frames).data, at_once(scene, lit, scene.exhibit).data);
}

}  // namespace
}  // namespace lumigraft::test
