// Cost of composing a frame in which a noisy depth camera sees a hand before an object, at 640 × 480 pixels, by stage.
//
//   build/release/composer_cost
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <memory>
#include <random>
#include <vector>

#include "capture/camera/srgb.h"
#include "relight/compose/add_noise.h"
#include "relight/compose/change_matte.h"
#include "relight/compose/composer.h"
#include "relight/compose/foreground_matte.h"
#include "relight/compose/soften.h"
#include "relight/look/camera_look.h"
#include "relight/tracing/parallel_for.h"
#include "tests/relight/closed_form/closed_scene.h"
#include "tests/relight/compose/drawn_hand.h"

namespace lumigraft::test {
namespace {

using Eigen::Vector2f;

constexpr int kWidth = 640, kHeight = 480, kRepeats = 200, kPictures = 12;
constexpr float kScale = 2;  // of the hand
constexpr float kHand_m = 0.6f, kObject_m = 0.8f, kTable_m = 1;
constexpr int kLeft = 160, kTop = 120, kAcross = 300, kDown = 260;  // of the object, pixels

/// What a frame gives to the composer.
struct Inputs {
  capture::Session session;
  std::unique_ptr<relight::PixelRays> rays;
  std::unique_ptr<relight::CameraUpload> picture;
  capture::Image<float> depth_m{kWidth, kHeight, 1}, change{kWidth, kHeight, 3};
  capture::Image<std::uint8_t> front{kWidth, kHeight, 1};
  relight::ObjectLayer objects{kLeft, kTop, capture::Image<float>(kAcross, kDown, 3),
                               capture::Image<float>(kAcross, kDown, 1), capture::Image<float>(kAcross, kDown, 1)};
};

void draw_object(Inputs& inputs) {
  for (int y = 0; y < kDown; ++y) {
    for (int x = 0; x < kAcross; ++x) {
      const float from_middle = std::hypot((static_cast<float>(x) - kAcross / 2.0f) / (kAcross / 2.0f - 2),
                                           (static_cast<float>(y) - kDown / 2.0f) / (kDown / 2.0f - 2));
      const float covered = std::clamp((1 - from_middle) * kDown / 2, 0.0f, 1.0f);
      inputs.objects.coverage.at(x, y) = covered;
      for (int c = 0; c < 3; ++c) inputs.objects.radiance.at(x, y, c) = 0.3f * covered;
      if (covered > 0) inputs.objects.distance_m.at(x, y) = kObject_m / inputs.rays->at(x + kLeft, y + kTop).z();
    }
  }
}

Inputs draw() {
  Inputs inputs;
  ClosedScene scene;
  scene.width = kWidth;
  scene.height = kHeight;
  scene.focal_px = 560;
  inputs.session = scene.session();
  inputs.rays = std::make_unique<relight::PixelRays>(inputs.session.color.model);
  const DrawnHand hand({0, 0}, kScale);
  std::mt19937 random(7);
  std::normal_distribution<float> normal;
  std::uniform_real_distribution<float> uniform;
  auto color = std::make_shared<capture::Frame>();
  color->encoded = capture::Image<std::uint8_t>(kWidth, kHeight, 3);
  const float table[2][3] = {{0.5f, 0.52f, 0.5f}, {0.2f, 0.22f, 0.24f}}, skin[3] = {0.42f, 0.26f, 0.19f};
  for (int v = 0; v < kHeight; ++v) {
    for (int u = 0; u < kWidth; ++u) {
      const Vector2f p(static_cast<float>(u), static_cast<float>(v));
      const float away = hand.distance_px(p), alpha = std::clamp(0.5f - away, 0.0f, 1.0f);
      const bool hole = uniform(random) < (std::abs(away) < 4 ? 0.2f : 0.03f);
      const bool in_depth = hand.distance_px(p + Vector2f(normal(random), normal(random))) < 0;
      const float depth_m = hole ? 0 : (in_depth ? kHand_m : kTable_m) + 0.003f * normal(random);
      inputs.depth_m.at(u, v) = depth_m;
      inputs.front.at(u, v) = !hole && in_depth ? 255 : 0;
      // A shadow that reaches a few hundred pixels.
      const float shadow = std::exp(-std::pow((p.x() - 320) / 90, 2.0f) - std::pow((p.y() - 260) / 60, 2.0f));
      for (int c = 0; c < 3; ++c) {
        const float mixed = alpha * skin[c] + (1 - alpha) * table[(u / 48 + v / 48) % 2][c];
        color->encoded.at(u, v, c) = capture::srgb_table().code(mixed * (1 + 0.01f * normal(random)));
        inputs.change.at(u, v, c) = (away < 0 ? -0.02f : -0.08f) * shadow;
      }
    }
  }
  capture::FrameSet frame;
  frame.color = color;
  inputs.picture = std::make_unique<relight::CameraUpload>(inputs.session.color);
  inputs.picture->take(frame);
  draw_object(inputs);
  return inputs;
}

/// Least and median, as other programs disturb single runs. `prepare` is not measured: it copies what the stage changes
/// in place.
template <typename Prepare, typename Stage>
void measure(const char* name, Prepare prepare, Stage stage) {
  std::vector<double> cpu_ms, wall_ms;
  for (int i = 0; i < kRepeats; ++i) {
    prepare();
    const auto begin = std::chrono::steady_clock::now();
    const std::clock_t cpu = std::clock();
    stage();
    cpu_ms.push_back(1e3 * static_cast<double>(std::clock() - cpu) / CLOCKS_PER_SEC);
    wall_ms.push_back(std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count());
  }
  std::sort(cpu_ms.begin(), cpu_ms.end());
  std::sort(wall_ms.begin(), wall_ms.end());
  std::printf("%-18s %5.2f ms of processor time at least, %5.2f in the median; %5.2f, %5.2f ms\n", name, cpu_ms[0],
              cpu_ms[kRepeats / 2], wall_ms[0], wall_ms[kRepeats / 2]);
}
template <typename Stage>
void measure(const char* name, Stage stage) {
  measure(
      name, [] {}, stage);
}

void run() {
  // After a large block is freed the C library keeps smaller ones, as in a process that frees larger ones in each
  // frame.
  std::make_unique<std::array<char, std::size_t{30} << 20>>();
  const Inputs inputs = draw();
  const relight::CurrentDepth depth(*inputs.rays, &inputs.depth_m, 0.008f);
  const relight::CameraUpload& picture = *inputs.picture;

  relight::ObjectLayer soft, shown;
  measure("sharpness", [&] { soft = relight::softened(inputs.objects, 0.5f, kWidth, kHeight); });
  measure(
      "matte of objects", [&] { shown = soft; }, [&] { relight::hide_behind_foreground(depth, picture, shown); });
  capture::Image<float> change;
  measure(
      "matte of change", [&] { change = inputs.change; },
      [&] { relight::divide_change(depth, picture, inputs.front, inputs.objects, change); });
  const capture::Image<float> radiance = picture.radiance();
  capture::Image<std::uint8_t> composed;
  measure("composing", [&] {
    composed = *picture.coded();
    relight::compose(picture, {change, &radiance, true}, shown, &composed);
  });

  std::mt19937 random(3);
  std::normal_distribution<float> normal;
  std::vector<std::shared_ptr<const capture::Image<std::uint8_t>>> pictures;
  for (int k = 0; k < kPictures; ++k) {
    auto noisy = std::make_shared<capture::Image<std::uint8_t>>(*picture.coded());
    for (std::uint8_t& code : noisy->data)
      code =
          static_cast<std::uint8_t>(std::clamp(static_cast<float>(code) + 1.3f * normal(random) + 0.5f, 0.0f, 255.0f));
    pictures.push_back(noisy);
  }
  relight::NoiseEstimator noise;
  const relight::Viewpoint viewpoint{inputs.session.color.model, Eigen::Isometry3d::Identity(), &inputs.depth_m};
  std::size_t frame = 0;
  const auto follow = [&] { noise.take(pictures[frame++ % kPictures], viewpoint); };
  for (int i = 0; i < 5 * kPictures; ++i) follow();
  measure("measuring noise", follow);
  if (!noise.model()) return;
  capture::Image<std::uint8_t> noisy;
  measure(
      "noise", [&] { noisy = composed; },
      [&] { relight::add_noise(*noise.model(), *picture.coded(), shown, 5, &noisy); });
  // In the order of RayRenderer.
  measure(
      "all of it", [&] { change = inputs.change; },
      [&] {
        follow();
        relight::for_each_index(2, 1, [&](int k) {
          if (k == 0) {
            shown = relight::softened(inputs.objects, 0.5f, kWidth, kHeight);
            relight::hide_behind_foreground(depth, picture, shown);
          } else {
            relight::divide_change(depth, picture, inputs.front, inputs.objects, change);
          }
        });
        noisy = *picture.coded();
        relight::compose(picture, {change, &radiance, true}, shown, &noisy);
        relight::add_noise(*noise.model(), *picture.coded(), shown, 5, &noisy);
      });
}

}  // namespace
}  // namespace lumigraft::test

int main() { lumigraft::test::run(); }
