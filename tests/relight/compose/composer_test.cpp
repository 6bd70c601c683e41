// The composer, and the layers that the device renders for it.
#include "relight/compose/composer.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <utility>

#include "capture/camera/srgb.h"
#include "relight/compose/parameters.h"
#include "relight/compose/read_tiles.h"
#include "relight/compose/rgb_image.h"
#include "relight/passes/screen/layers.h"
#include "relight/tracing/bsdf.h"
#include "tests/relight/gpu/device_fixture.h"

namespace lumigraft::relight {
namespace {

constexpr int kWidth = 56, kHeight = 40;
constexpr std::size_t kPixels = kWidth * kHeight;
constexpr float kAlbedo = 0.75f;   // of all real surfaces; exact as a half
constexpr float kObject_m = 0.8f;  // along z

enum Kind { untouched, changed, darkened, nan_change, infinite_change, object, edge, nan_object, kKinds };
Kind kind_of(std::size_t pixel) { return static_cast<Kind>(pixel % kKinds); }

/// Neighbouring pixels are of different kinds.
struct Inputs {
  std::vector<Eigen::half> irradiance = std::vector<Eigen::half>(4 * kPixels);  ///< its change
  std::vector<Eigen::half> radiance = irradiance;                               ///< of objects
  std::vector<float> surface = std::vector<float>(4 * kPixels);                 ///< x: depth; y: coverage
};

Inputs random_inputs(std::mt19937& random) {
  std::uniform_real_distribution<float> change(-1, 1), light(0, 1.5f), part(0.05f, 0.95f);
  Inputs inputs;
  for (std::size_t i = 0; i < kPixels; ++i) {
    const Kind kind = kind_of(i);
    for (std::size_t c = 0; c < 3; ++c) {
      const float own = kind == untouched || kind == object ? 0 : kind == darkened ? -100 : change(random);
      inputs.irradiance[4 * i + c] = static_cast<Eigen::half>(own);
      inputs.radiance[4 * i + c] = static_cast<Eigen::half>(kind >= object ? light(random) : 0);
    }
    if (kind == nan_change) inputs.irradiance[4 * i + 1] = static_cast<Eigen::half>(NAN);
    if (kind == infinite_change) inputs.irradiance[4 * i + 2] = static_cast<Eigen::half>(-INFINITY);
    if (kind == nan_object) inputs.radiance[4 * i] = static_cast<Eigen::half>(NAN);
    inputs.surface[4 * i] = kind >= object ? kObject_m : 0;
    inputs.surface[4 * i + 1] = kind == object ? 1 : kind > object ? part(random) : 0;
  }
  return inputs;
}

capture::FrameSet random_frame(std::mt19937& random, bool encoded) {
  auto picture = std::make_shared<capture::Frame>();
  picture->exposure = 0.8;
  if (encoded) {
    picture->encoded = capture::Image<std::uint8_t>(kWidth, kHeight, 3);
    for (std::uint8_t& code : picture->encoded.data) code = static_cast<std::uint8_t>(random());
  } else {
    picture->radiance = capture::Image<float>(kWidth, kHeight, 3);
    for (float& value : picture->radiance.data) value = std::uniform_real_distribution<float>(0, 1.2f)(random);
  }
  capture::FrameSet frame;
  frame.color = std::move(picture);
  return frame;
}

capture::Image<std::uint8_t> composed_on_cpu(const CameraUpload& camera, const Inputs& inputs) {
  capture::Image<float> change(kWidth, kHeight, 3), radiance(kWidth, kHeight, 3), coverage(kWidth, kHeight, 1);
  for (std::size_t i = 0; i < kPixels; ++i) {
    coverage.data[i] = inputs.surface[4 * i + 1];
    for (std::size_t c = 0; c < 3; ++c) {
      change.data[3 * i + c] = kAlbedo / kPi * static_cast<float>(inputs.irradiance[4 * i + c]);
      radiance.data[3 * i + c] = coverage.data[i] * static_cast<float>(inputs.radiance[4 * i + c]);
    }
  }
  capture::Image<std::uint8_t> picture = *camera.coded();
  compose(camera, {change}, {0, 0, radiance, coverage, {}}, &picture);
  return picture;
}

class Composer : public gpu::DeviceTest {
 protected:
  capture::Image<std::uint8_t> composed_from_device(const CameraUpload& camera, const capture::FrameSet& frame,
                                                    const Inputs& inputs) {
    Screen screen(*device_, kWidth, kHeight, 1, 1, 1, 1, 1);
    camera.upload(*device_, frame, true, screen);
    shader::FrameParams params{};
    params.exposure.head<3>() = camera.exposure().matrix();
    params.picture << kWidth, kHeight, 1, 1;
    screen.tiles->choose(*device_, params, {{}, nullptr, *camera.coded()}, {}, {.glossy = {}, .all = true});
    device_->upload(*screen.indirect, 0, std::as_bytes(std::span(inputs.irradiance)));
    device_->upload(*screen.object_radiance, 0, std::as_bytes(std::span(inputs.radiance)));
    device_->upload(*screen.object_surface, 0, std::as_bytes(std::span(inputs.surface)));
    const Layers pass(*device_);
    const auto list = device_->begin();
    list->begin_pass("layers");
    list->clear(*screen.real_normal, {0, 0, 1, 1});
    list->clear(*screen.real_albedo, {kAlbedo, kAlbedo, kAlbedo, 0});
    for (const auto* unused : {&screen.direct_lost, &screen.mirror_gained_smooth, &screen.mirror_fraction_smooth,
                               &screen.object_normal, &screen.object_other, &screen.real_position}) {
      list->clear(**unused, {});
    }
    pass.record(*list, params, screen);
    device_->submit(*list);
    capture::Image<float> change(kWidth, kHeight, 3);
    const std::vector<std::uint32_t>& places = screen.tiles->view_places();
    const std::array<WantedTiles, 2> of_objects = object_tiles(screen, places);
    const WantedTiles wanted[] = {{*screen.delta, places}, of_objects[0], of_objects[1]};
    const TileReader reader(*device_, wanted);
    reader.read(0, 0, 3, &change.data);
    ObjectLayer objects;
    const std::vector<float> rays(2 * kPixels, 0.5f);
    read_objects(reader, 1, screen, rays, places, &objects);
    for (std::size_t i = 0; i < kPixels; ++i) {
      const float along_ray_m = kind_of(i) >= object ? kObject_m * std::sqrt(1.5f) : 0;
      EXPECT_NEAR(objects.distance_m.data[i], along_ray_m, 1e-5f) << i;
    }
    capture::Image<std::uint8_t> picture = *camera.coded();
    compose(camera, {change}, objects, &picture);
    return picture;
  }
};
ON_BOTH_DEVICES(Composer);

TEST_P(Composer, BlendsWhatTheDeviceRenders) {
  std::mt19937 random(3);
  for (const bool encoded : {true, false}) {
    SCOPED_TRACE(encoded);
    const Inputs inputs = random_inputs(random);
    capture::FrameSet frame = random_frame(random, encoded);
    frame.color_gain = {0.6f, 1, 1.7f};
    CameraUpload camera{capture::ColorCamera{}};
    camera.take(frame);
    const capture::Image<std::uint8_t> cpu = composed_on_cpu(camera, inputs);
    const capture::Image<std::uint8_t> device = composed_from_device(camera, frame, inputs);
    int differing = 0;
    for (std::size_t i = 0; i < kPixels; ++i) {
      const Kind kind = kind_of(i);
      const bool kept = kind == untouched || kind == nan_change || kind == infinite_change;
      for (std::size_t c = 0; c < 3; ++c) {
        const int on_cpu = cpu.data[3 * i + c], on_device = device.data[3 * i + c];
        if (kept) {
          ASSERT_EQ(on_cpu, camera.coded()->data[3 * i + c]) << i;
        }
        if (kept || kind == darkened) {
          ASSERT_EQ(on_cpu, on_device) << i;
        }
        ASSERT_LE(std::abs(on_cpu - on_device), 1) << i;
        differing += on_cpu != on_device;
      }
    }
    EXPECT_LT(differing, static_cast<int>(kPixels) / 100) << "halves round";
  }
}

TEST(ComposerOfOne, ChangeIsProportionalToThePixelOfNow) {
  capture::ColorCamera of_camera;
  of_camera.model.width = 3;
  of_camera.model.height = 1;
  CameraUpload camera(of_camera);
  capture::FrameSet frame;
  auto picture = std::make_shared<capture::Frame>();
  picture->encoded = capture::Image<std::uint8_t>(3, 1, 3, 128);
  for (int c = 0; c < 3; ++c) picture->encoded.at(2, 0, c) = 255;
  frame.color = picture;
  camera.take(frame);
  const float now = camera.radiance(0)[0];
  // The change was computed when the second pixel was 1.25 times as bright; the third clips, and is twice as bright.
  const capture::Image<float> delta(3, 1, 3, -0.1f);
  capture::Image<float> then(3, 1, 3, now);
  for (int c = 0; c < 3; ++c) {
    then.at(1, 0, c) = 1.25f * now;
    then.at(2, 0, c) = 2;
  }
  const auto light_at = [&](bool proportional, int u) {
    capture::Image<std::uint8_t> out = *camera.coded();
    compose(camera, {delta, &then, proportional}, {}, &out);
    return capture::srgb_table().linear[out.at(u, 0, 0)];
  };
  EXPECT_NEAR(light_at(false, 0), now - 0.1f, 0.004f);
  EXPECT_NEAR(light_at(false, 1), now - 0.1f, 0.004f);
  EXPECT_NEAR(light_at(true, 0), now - 0.1f, 0.004f);
  EXPECT_NEAR(light_at(true, 1), now - 0.08f, 0.004f);
  EXPECT_EQ(light_at(false, 2), 1) << "what clips stays white where it stays too bright";
}

TEST(ComposerOfOne, ASmallChangeGrowsWithThePixel) {
  constexpr int kWide = 8, kCode = 128;
  capture::ColorCamera of_camera;
  of_camera.model.width = kWide;
  of_camera.model.height = 1;
  CameraUpload camera(of_camera);
  capture::FrameSet frame;
  auto picture = std::make_shared<capture::Frame>();
  picture->encoded = capture::Image<std::uint8_t>(kWide, 1, 3, kCode);
  frame.color = picture;
  camera.take(frame);
  // Less than half a pixel value for the light of then, more for twice as much.
  const std::array<float, 256>& linear = capture::srgb_table().linear;
  const capture::Image<float> delta(kWide, 1, 3, 0.4f * (linear[kCode + 1] - linear[kCode])),
      then(kWide, 1, 3, camera.radiance(0)[0] / 2);
  capture::Image<std::uint8_t> out = *camera.coded();
  compose(camera, {delta, &then, true}, {}, &out);
  for (const std::uint8_t code : out.data) EXPECT_EQ(code, kCode + 1);
  out = *camera.coded();
  compose(camera, {delta, &then, false}, {}, &out);
  for (const std::uint8_t code : out.data) EXPECT_EQ(code, kCode);
}

/// compose() as it is described, pixel by pixel.
capture::Image<std::uint8_t> composed_slowly(const CameraUpload& camera, const RoomChange& change,
                                             const ObjectLayer& objects) {
  capture::Image<std::uint8_t> picture = *camera.coded();
  for (int v = 0; v < picture.height; ++v) {
    for (int u = 0; u < picture.width; ++u) {
      const auto i = static_cast<std::size_t>(v * picture.width + u);
      const auto finite = [](const Rgb& light) { return light.allFinite() ? light : Rgb::Zero(); };
      const auto window = objects.index(u, v);
      const float coverage = window ? objects.coverage.data[*window] : 0;
      Rgb delta = finite(radiance_at(change.delta, i));
      if (coverage == 0 && (delta == 0).all()) continue;
      Rgb light = camera.radiance(i);
      if (change.radiance) {
        const Rgb then = radiance_at(*change.radiance, i);
        for (int c = 0; c < 3; ++c) {
          if (camera.clipped(i, static_cast<std::size_t>(c))) light[c] = std::max(light[c], then[c]);
          if (change.proportional && then[c] > 0)
            delta[c] *= std::clamp(light[c] / std::max(then[c], 1e-6f), 1 / kCompose.max_flicker, kCompose.max_flicker);
        }
      }
      light = (light + delta).max(0.0f);
      if (coverage > 0)
        light = composed(light, finite(radiance_at(objects.radiance, *window)), Rgb(Rgb::Constant(coverage)));
      light = light.max(0.0f) * camera.exposure() * camera.transmission(i);
      for (int c = 0; c < 3; ++c) picture.at(u, v, c) = capture::srgb_table().code(light[c]);
    }
  }
  return picture;
}

/// What is skipped or computed for several pixels at once changes nothing.
TEST(ComposerOfOne, IsEqualToComposingPixelByPixel) {
  constexpr int kWide = 83, kHigh = 40, kLeft = 9, kTop = 5, kAcross = 47, kDown = 30;
  std::mt19937 random(5);
  std::uniform_real_distribution<float> part(0, 1);
  for (const bool vignetted : {false, true}) {
    capture::ColorCamera of_camera;
    of_camera.model.width = kWide;
    of_camera.model.height = kHigh;
    CameraUpload camera(of_camera);
    capture::FrameSet frame;
    auto picture = std::make_shared<capture::Frame>();
    picture->exposure = 0.7;
    picture->encoded = capture::Image<std::uint8_t>(kWide, kHigh, 3);
    // What clips is white, which stays as it is where it does not change.
    for (std::uint8_t& code : picture->encoded.data) {
      code = static_cast<std::uint8_t>(random());
      if (code >= capture::kFullScale) code = 255;
    }
    frame.color = picture;
    frame.color_gain = {0.8f, 1, 1.3f};
    if (vignetted) {
      auto falls = std::make_shared<capture::Image<float>>(kWide, kHigh, 1);
      for (int i = 0; i < kWide * kHigh; ++i)
        falls->data[static_cast<std::size_t>(i)] = 1 + static_cast<float>(i % kWide) / kWide;
      frame.color_vignetting = falls;
    }
    camera.take(frame);
    capture::Image<float> delta(kWide, kHigh, 3), then(kWide, kHigh, 3);
    const capture::Image<float> empty(kAcross, kDown, 1);
    ObjectLayer objects{kLeft, kTop, capture::Image<float>(kAcross, kDown, 3), empty, empty};
    // Runs of pixels alike, of any length.
    float scale = 0, covered = 0;
    for (std::size_t i = 0; i < delta.data.size() / 3; ++i) {
      if (part(random) < 0.2f) scale = part(random) < 0.3f ? 0 : std::pow(10.0f, -5 * part(random));
      for (std::size_t c = 0; c < 3; ++c) {
        delta.data[3 * i + c] = scale * (2 * part(random) - 1);
        then.data[3 * i + c] = part(random) < 0.05f ? 0 : 1.5f * part(random);
      }
      if (part(random) < 0.01f) delta.data[3 * i] = NAN;
    }
    for (std::size_t i = 0; i < objects.coverage.data.size(); ++i) {
      if (part(random) < 0.2f) covered = std::clamp(3 * part(random) - 1, 0.0f, 1.0f);
      objects.coverage.data[i] = covered;
      for (std::size_t c = 0; c < 3; ++c) objects.radiance.data[3 * i + c] = covered * 2 * (part(random) - 0.2f);
      if (part(random) < 0.01f) objects.radiance.data[3 * i + 1] = INFINITY;
    }
    for (const bool proportional : {false, true}) {
      for (const capture::Image<float>* radiance :
           {static_cast<const capture::Image<float>*>(nullptr), &std::as_const(then)}) {
        capture::Image<std::uint8_t> fast = *camera.coded();
        compose(camera, {delta, radiance, proportional}, objects, &fast);
        const capture::Image<std::uint8_t> slow = composed_slowly(camera, {delta, radiance, proportional}, objects);
        int differing = 0;
        for (std::size_t i = 0; i < fast.data.size(); ++i) differing += fast.data[i] != slow.data[i];
        EXPECT_EQ(differing, 0) << vignetted << proportional << (radiance != nullptr);
      }
    }
  }
}

/// A pixel is left alone only where its change is below the next pixel value.
TEST(ComposerOfOne, SmallChangesGiveTheNearestPixelValue) {
  constexpr int kCodes = 256, kSteps = 41;
  capture::ColorCamera of_camera;
  of_camera.model.width = kSteps;
  of_camera.model.height = kCodes;
  CameraUpload camera(of_camera);
  auto picture = std::make_shared<capture::Frame>();
  picture->encoded = capture::Image<std::uint8_t>(kSteps, kCodes, 3);
  picture->exposure = 2;
  capture::Image<float> delta(kSteps, kCodes, 3);
  const capture::SrgbTable& srgb = capture::srgb_table();
  const auto off = [](int step) { return 0.1f * static_cast<float>(step - kSteps / 2); };  // in pixel values
  for (int code = 0; code < kCodes; ++code) {
    for (int step = 0; step < kSteps; ++step) {
      const float to = std::max(static_cast<float>(code) + off(step), 0.0f) / 255;
      for (int c = 0; c < 3; ++c) {
        picture->encoded.at(step, code, c) = static_cast<std::uint8_t>(code);
        delta.at(step, code, c) = (capture::srgb_to_linear(to) - srgb.linear[static_cast<std::size_t>(code)]) / 2;
      }
    }
  }
  capture::FrameSet frame;
  frame.color = picture;
  camera.take(frame);
  capture::Image<std::uint8_t> out = *camera.coded();
  compose(camera, {delta}, {}, &out);
  for (int code = 0; code < kCodes; ++code) {
    for (int step = 0; step < kSteps; ++step) {
      const float exact = std::clamp(static_cast<float>(code) + off(step), 0.0f, 255.0f);
      for (int c = 0; c < 3; ++c) EXPECT_NEAR(out.at(step, code, c), exact, 0.51f) << code << " + " << off(step);
    }
  }
}

}  // namespace
}  // namespace lumigraft::relight
