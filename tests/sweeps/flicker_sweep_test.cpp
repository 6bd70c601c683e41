// Flicker of real pixels while an object, a lamp or the volumes move.
#include <algorithm>
#include <functional>

#include "capture/camera/srgb.h"
#include "tests/sweeps/sweep.h"

namespace lumigraft::test {
namespace {

class FlickerSweep : public SweepTest {
 protected:
  /// Renders `frames` frames of a scene that `at` changes, as in serving: without maps, the last of `held` pictures
  /// each.
  std::vector<capture::Image<std::uint8_t>> film(ClosedScene scene, const relight::Plan& plan, int frames,
                                                 const std::function<void(ClosedScene*, int)>& at, int held = 1) const {
    relight::Relighter relighter(device_, scene.session());
    const capture::FrameSet frame = scene.frame();
    reconstruct::Scene room = scene.scene();
    std::vector<capture::Image<std::uint8_t>> pictures;
    for (int i = 0; i < frames; ++i) {
      at(&scene, i);
      if (i > 0) room.illumination = illumination_of(scene, *room.illumination);
      for (int n = 1; n < held; ++n) relighter.relight(frame, room, scene.exhibit, plan);
      pictures.push_back(relighter.relight(frame, room, scene.exhibit, plan).srgb);
    }
    return pictures;
  }

 private:
  static std::shared_ptr<const reconstruct::Illumination> illumination_of(const ClosedScene& scene,
                                                                          const reconstruct::Illumination& before) {
    auto now = std::make_shared<reconstruct::Illumination>(before);
    now->lights = scene.lamps;
    ++now->version;
    return now;
  }
};
ON_VULKAN(FlickerSweep);

constexpr float kRadius_m = 0.1f;
constexpr int kFrames = 4,
              kRounds = 60;  // kRounds: more than two update cycles of live settings, which have then converged

ClosedScene grey_floor() {
  ClosedScene scene;
  scene.width = 56;
  scene.height = 42;
  scene.focal_px = 48;
  scene.sky = 0.3f;
  scene.radiance = [](const Eigen::Vector3f&) { return 0.3f; };
  scene.lamps = {lamp_at({0.3f, 0.2f, 0.5f}, 0.02f, 0.4f)};
  return scene;
}

/// Pixels of the floor, away from the ball of this radius around `centre`.
std::vector<std::size_t> floor_pixels(const ClosedScene& scene, const Eigen::Vector3f& centre, float radius_m) {
  std::vector<std::size_t> pixels;
  for (int v = 0; v < scene.height; ++v) {
    for (int u = 0; u < scene.width; ++u) {
      const Eigen::Vector3f w = (scene.on_plane(u, v) - scene.eye_m).normalized();
      if (w.z() < 0 && (centre - scene.eye_m).cross(w).norm() > radius_m + 0.03f) {
        pixels.push_back(
            3 * (static_cast<std::size_t>(v) * static_cast<std::size_t>(scene.width) + static_cast<std::size_t>(u)));
      }
    }
  }
  EXPECT_GT(pixels.size(), 800u);
  return pixels;
}

using Film = std::vector<capture::Image<std::uint8_t>>;

/// RMS over pixels of the deviation of frame i from the mean of all frames, minus the expected deviation `want(pixel,
/// frame)` in pixel values.
template <typename Want>
std::vector<double> off_the_mean(const Film& film, const std::vector<std::size_t>& pixels, const Want& want) {
  std::vector<double> squares(film.size(), 0.0);
  for (const std::size_t pixel : pixels) {
    double mean = 0;
    for (std::size_t i = 0; i < film.size(); ++i)
      mean += (film[i].data[pixel] - want(pixel, i)) / static_cast<double>(film.size());
    for (std::size_t i = 0; i < film.size(); ++i) {
      const double off = film[i].data[pixel] - want(pixel, i) - mean;
      squares[i] += off * off;
    }
  }
  for (double& s : squares) s = std::sqrt(s / static_cast<double>(pixels.size()));
  return squares;
}

/// Number of pixels that differ between the first and the last picture.
int changed(const Film& film, const std::vector<std::size_t>& pixels) {
  return static_cast<int>(std::count_if(pixels.begin(), pixels.end(), [&](std::size_t pixel) {
    return film.front().data[pixel] != film.back().data[pixel];
  }));
}

/// Standard deviation of per-frame noise: smooth changes have almost no second difference, and independent deviations σ
/// have one of σ √6.
std::vector<double> off_the_trend(const Film& film, const std::vector<std::size_t>& pixels) {
  std::vector<double> rms(film.size(), 0.0);
  for (std::size_t i = 1; i + 1 < film.size(); ++i) {
    double squares = 0;
    for (const std::size_t pixel : pixels) {
      const double second = film[i - 1].data[pixel] - 2.0 * film[i].data[pixel] + film[i + 1].data[pixel];
      squares += second * second / 6;
    }
    rms[i] = std::sqrt(squares / static_cast<double>(pixels.size()));
  }
  rms.front() = rms[1];
  rms.back() = rms[rms.size() - 2];
  return rms;
}

Sweep flicker(const std::string& stem, const std::string& title) {
  Sweep sweep{.stem = "flicker-" + stem,
              .title = title,
              .x_label = "frame",
              .y_label = "deviation of real pixels, code values RMS",
              .x = {},
              .max = 1};
  for (int i = 0; i < kFrames; ++i) sweep.x.push_back(i);
  return sweep;
}

// A ball that rotates about its axis must not change the room. A rotating box changes it smoothly.
TEST_P(FlickerSweep, ObjectTurningByADegreeAFrame) {
  Sweep sweep = flicker("turning", "Object turning by 1° a frame");
  for (const bool box : {false, true}) {
    ClosedScene scene = grey_floor();
    scene.exhibit.objects = {box ? box_object({-0.08f, -0.06f, 0}, {0.08f, 0.06f, 0.16f}, 0.7f)
                                 : sphere_object(kRadius_m, {0, 0, 0.13f}, 0.7f)};
    const auto pixels = floor_pixels(scene, {0, 0, box ? 0.08f : 0.13f}, box ? 0.13f : kRadius_m);
    for (const Method& method : methods(32, 2)) {
      if (box && method.plan.method == "dlpv") continue;
      const Film pictures = film(scene, method.plan, kFrames, [](ClosedScene* s, int i) {
        s->exhibit.objects[0].rotation = Eigen::AngleAxisd(0.3 + 0.01745329 * i, Eigen::Vector3d::UnitZ());
      });
      sweep.curves.push_back({method.name + (box ? ", box" : ", ball"),
                              box ? off_the_trend(pictures, pixels)
                                  : off_the_mean(pictures, pixels, [](std::size_t, std::size_t) { return 0.0; })});
    }
  }
  expect_within_bounds(sweep);
}

// Injection by samples that move on the object in each frame would flicker.
TEST_P(FlickerSweep, LampMovingByAMillimetreAFrame) {
  Sweep sweep = flicker("lamp", "Lamp moving by 1 mm a frame");
  ClosedScene scene = grey_floor();
  scene.exhibit.objects = {sphere_object(kRadius_m, {0, 0, 0.13f}, 0.9f)};
  const auto pixels = floor_pixels(scene, {0, 0, 0.13f}, kRadius_m);
  for (const Method& method : methods(32, 2)) {
    const Film pictures = film(scene, method.plan, kFrames, [](ClosedScene* s, int i) {
      s->lamps = {lamp_at({0.3f + 1e-3f * static_cast<float>(i), 0.2f, 0.5f}, 0.02f, 0.4f)};
    });
    EXPECT_GT(changed(pictures, pixels), 5);
    sweep.curves.push_back({method.name, off_the_trend(pictures, pixels)});
  }
  expect_within_bounds(sweep);
}

// A black ball moves by 1 mm a frame under a uniform sky, and the volumes with it, in voxels of 8 and 28 mm. Each
// pixel's deviation from the ball's form factor, cos θ (r/d)², must stay constant.
TEST_P(FlickerSweep, VolumeFollowingTheObject) {
  constexpr float height_m = 0.13f;
  Sweep sweep = flicker("volume", "Object moving by 1 mm a frame, the volumes with it");
  ClosedScene scene = grey_floor();
  scene.lamps.clear();
  scene.exhibit.objects = {sphere_object(kRadius_m, {0, 0, height_m}, 0)};
  const auto pixels = floor_pixels(scene, {0, 0, height_m}, kRadius_m);
  for (const Method& method : methods(32, 1)) {
    const Film pictures = film(
        scene, method.plan, kFrames, [](ClosedScene* s, int i) { s->exhibit.objects[0].position_m.x() = 1e-3 * i; },
        method.plan.in_cells() ? kRounds : 1);
    EXPECT_GT(changed(pictures, pixels), 5) << method.name;
    sweep.curves.push_back({method.name, off_the_mean(pictures, pixels, [&](std::size_t pixel, std::size_t i) {
                              const int at = static_cast<int>(pixel / 3);
                              const Eigen::Vector3f to = Eigen::Vector3f(1e-3f * static_cast<float>(i), 0, height_m) -
                                                         scene.on_plane(at % scene.width, at / scene.width);
                              const float hidden = height_m * kRadius_m * kRadius_m / std::pow(to.norm(), 3.0f);
                              return 255.0 * capture::linear_to_srgb(0.3f * (1 - hidden));
                            })});
  }
  expect_within_bounds(sweep);
}

}  // namespace
}  // namespace lumigraft::test
