// Every renderer gives objects the camera's noise and sharpness with plan.look = camera, and neither with plain.
#include <cmath>

#include "relight/reference/reference_renderer.h"
#include "relight/views/ray_renderer.h"
#include "tests/relight/closed_form/closed_scene.h"
#include "tests/relight/look/noisy_camera.h"

namespace lumigraft::test {
namespace {

constexpr int kShown = 12, kCompared = 7;
constexpr double kBlur = 2.2;  // of the tag's edges; 1 is that of pixels alone

capture::FrameSet frame_with(const capture::FrameSet& base, const std::shared_ptr<const Codes>& codes, int index) {
  capture::FrameSet frame = base;
  auto color = std::make_shared<capture::Frame>();
  color->exposure = 1;
  color->encoded = *codes;
  frame.color = std::move(color);
  frame.index = static_cast<std::uint64_t>(index);
  return frame;
}

/// `make()` creates a renderer.
template <typename Make>
void objects_look_like_the_camera(const Make& make, relight::Plan plan) {
  const ClosedScene scene = box_on_floor();
  const capture::FrameSet base = scene.frame();
  cv::Mat3f light(scene.height, scene.width);
  std::copy_n(base.color->radiance.data.begin(), base.color->radiance.data.size(), light.ptr<float>());
  reconstruct::Scene room = scene.scene();
  NoisyCamera silent{.shot = 0, .read = 0};
  const capture::FrameSet clean = frame_with(base, silent.picture(light), 0);
  const relight::RelitPicture plain = make()->relight(clean, room, scene.exhibit, plan, true);
  std::vector<std::size_t> inside;  // pixels of objects
  for (int v = 4; v < scene.height - 4; ++v) {
    for (int u = 4; u < scene.width - 4; ++u) {
      bool all = true;
      for (int k = 0; k < 49; ++k) all = all && plain.maps->mask.at(u + k % 7 - 3, v + k / 7 - 3) > 0.999f;
      if (all) inside.push_back(plain.srgb.index(u, v));
    }
  }
  ASSERT_GT(inside.size(), 20u);

  // Noise: the temporal deviation of the object's pixels, against that of the floor in the picture's corner.
  for (const char* look : {"plain", "camera"}) {
    plan.look = look;
    NoisyCamera camera;
    const auto renderer = make();
    std::vector<double> sum(inside.size()), squares(inside.size());
    double floor_sum = 0, floor_squares = 0;
    for (int i = 0; i < kShown; ++i) {
      const capture::FrameSet frame = frame_with(base, camera.picture(light), i);
      const relight::RelitPicture picture = renderer->relight(frame, room, scene.exhibit, plan, false);
      if (i < kShown - kCompared) continue;
      for (std::size_t k = 0; k < inside.size(); ++k) {
        sum[k] += picture.srgb.data[inside[k]];
        squares[k] += std::pow(picture.srgb.data[inside[k]], 2);
      }
      floor_sum += frame.color->encoded.at(2, scene.height - 3, 0);
      floor_squares += std::pow(frame.color->encoded.at(2, scene.height - 3, 0), 2);
    }
    double variance = 0;
    for (std::size_t k = 0; k < inside.size(); ++k)
      variance += (squares[k] / kCompared - std::pow(sum[k] / kCompared, 2)) / static_cast<double>(inside.size());
    const double of_floor = floor_squares / kCompared - std::pow(floor_sum / kCompared, 2);
    if (plan.look == "plain") {
      EXPECT_LT(variance, 0.3 * of_floor) << plan.method;
    } else {
      EXPECT_GT(variance, 2) << plan.method << ": the camera's at this level is 4 to 8";
      EXPECT_LT(variance, 16) << plan.method;
    }
  }

  // Sharpness: the outline becomes wider, the inside stays.
  room.pose->blur_px = kBlur;
  plan.look = "camera";
  const relight::RelitPicture soft = make()->relight(clean, room, scene.exhibit, plan, false);
  plan.look = "plain";
  const relight::RelitPicture sharp = make()->relight(clean, room, scene.exhibit, plan, false);
  double change = 0, change_inside = 0;
  for (std::size_t i = 0; i < soft.srgb.data.size(); ++i)
    change = std::max(change, std::abs(double{1} * soft.srgb.data[i] - sharp.srgb.data[i]));
  for (const std::size_t i : inside)
    change_inside = std::max(change_inside, std::abs(double{1} * soft.srgb.data[i] - sharp.srgb.data[i]));
  EXPECT_GT(change, 5) << plan.method;
  EXPECT_LT(change_inside, 10) << plan.method << ": its own shading is blurred, too";
}

TEST(LookOfRenderers, Rays) {
  const capture::Session session = box_on_floor().session();
  objects_look_like_the_camera([&] { return std::make_unique<relight::RayRenderer>(session); }, rays_plan(8, 8));
}

TEST(LookOfRenderers, Reference) {
  const capture::Session session = box_on_floor().session();
  relight::Plan plan;
  plan.method = "reference";
  plan.samples = 8;
  objects_look_like_the_camera([&] { return std::make_unique<relight::ReferenceRenderer>(session); }, plan);
}

class LookOfDevices : public ClosedTest {};
ON_BOTH_DEVICES(LookOfDevices);

TEST_P(LookOfDevices, Live) {
  const capture::Session session = box_on_floor().session();
  objects_look_like_the_camera([&] { return std::make_unique<relight::Relighter>(device_, session); }, live_plan());
}

TEST_P(LookOfDevices, Full) {
  const capture::Session session = box_on_floor().session();
  objects_look_like_the_camera([&] { return std::make_unique<relight::Relighter>(device_, session); },
                               careful_plan(32));
}

}  // namespace
}  // namespace lumigraft::test
