// Path tracing of the change compared with the difference of two ordinary path-traced images: equal mean, lower cost.
#include <sched.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <vector>

#include "tests/relight/reference/reference_rooms.h"

namespace lumigraft::test {
namespace {

constexpr int kPictures = 12, kSamples = 32;

/// An object in the corner of a room with a lamp, seen from above.
relight::ReferenceScene corner(const relight::Material& floor, const relight::Material& object) {
  relight::ReferenceScene scene;
  Points walls;
  add_quad(&walls, {-1, 1, 0}, {1, 1, 0}, {1, 1, 1.2f}, {-1, 1, 1.2f});
  add_quad(&walls, {-1, -1, 0}, {-1, 1, 0}, {-1, 1, 1.2f}, {-1, -1, 1.2f});
  relight::Material red = lambert(0.7f);
  red.base_color = {0.7f, 0.2f, 0.1f};
  scene.real = {square(1, 0, floor), mesh_of(walls, red)};
  scene.objects = {mesh_of(box({-0.3f, -0.3f, 0}, {0.1f, 0.1f, 0.3f}), object),
                   ball(0.15f, {0.2f, 0.3f, 0.15f}, object)};
  scene.background.setConstant(0.1f);
  return scene;
}

relight::PosedCamera from_above() { return looking({0.7f, -1.6f, 1.2f}, {-0.1f, 0.1f, 0.1f}, 1.4f, 16, 12); }

relight::Material plastic() { return {{0.5f, 0.3f, 0.1f}, 0, 0.4f, 1}; }

struct Moments {
  std::vector<double> mean, variance;  // variance of a single image
};

Moments moments(const std::vector<std::vector<double>>& pictures) {
  const std::size_t n = pictures.front().size();
  const auto count = static_cast<double>(pictures.size());
  Moments m{std::vector<double>(n), std::vector<double>(n)};
  for (const auto& p : pictures) {
    for (std::size_t i = 0; i < n; ++i) m.mean[i] += p[i] / count;
  }
  for (const auto& p : pictures) {
    for (std::size_t i = 0; i < n; ++i) m.variance[i] += (p[i] - m.mean[i]) * (p[i] - m.mean[i]) / (count - 1);
  }
  return m;
}

/// Independent images of both kinds. Values are those of the pixels that show only the real room, followed by the mean
/// of each channel over these.
struct Compared {
  Moments change, difference;
};

Compared compare(const relight::ReferenceScene& scene) {
  const relight::DeltaPathTracer tracer = tracer_of(scene);
  const relight::PosedCamera camera = from_above();
  std::vector<std::vector<double>> changes, differences;
  const capture::Image<float> coverage = tracer.change(camera, samples_of(64)).coverage;
  const auto values = [&](const auto& value) {
    std::vector<double> out;
    std::array<double, 3> sums{};
    for (std::size_t i = 0; i < coverage.data.size(); ++i) {
      if (coverage.data[i] > 0) continue;
      for (std::size_t c = 0; c < 3; ++c) {
        out.push_back(value(3 * i + c));
        sums[c] += out.back();
      }
    }
    const double pixels = static_cast<double>(out.size()) / 3;
    for (const double sum : sums) out.push_back(sum / pixels);
    return out;
  };
  for (std::uint32_t i = 0; i < kPictures; ++i) {
    const capture::Image<float> change = tracer.change(camera, samples_of(kSamples, 3 * i)).change;
    const capture::Image<float> with = tracer.radiance(camera, samples_of(kSamples, 3 * i + 1), true);
    const capture::Image<float> without = tracer.radiance(camera, samples_of(kSamples, 3 * i + 2), false);
    changes.push_back(values([&](std::size_t at) { return change.data[at]; }));
    differences.push_back(values([&](std::size_t at) { return with.data[at] - without.data[at]; }));
  }
  return {moments(changes), moments(differences)};
}

double rms(const std::vector<double>& variance) {
  double sum = 0;
  for (std::size_t i = 0; i + 3 < variance.size(); ++i) sum += variance[i];
  return std::sqrt(sum / static_cast<double>(variance.size() - 3));
}

struct Case {
  const char* name;
  relight::ReferenceScene scene;
};

std::vector<Case> cases() {
  std::vector<Case> all;
  const relight::ReferenceLamp lamp = bulb({0.4f, -0.3f, 1.1f}, 0.08f, 60);
  const auto add = [&](const char* name, const relight::Material& floor,
                       const relight::Material& object) -> relight::ReferenceScene& {
    all.push_back({name, corner(floor, object)});
    all.back().scene.lamps = {lamp};
    return all.back().scene;
  };
  add("Lambert", lambert(0.6f), lambert(0.7f));
  add("metal object", lambert(0.6f), metal(0.9f, 0.3f));
  add("metal floor", metal(0.9f, 0.45f), lambert(0.7f));
  add("plastic on plastic", plastic(), plastic());
  add("panel", lambert(0.6f), lambert(0.7f)).lamps = {panel({0.3f, -0.2f, 1.1f}, 0.25f, 0.15f, 6)};
  add("round panel", lambert(0.6f), lambert(0.7f)).lamps = {round_panel({0.3f, -0.2f, 1.1f}, 0.2f, 8)};
  relight::ReferenceLamp spot = round_panel({0.3f, -0.6f, 1.2f}, 0.05f, 150);
  spot.normal = Eigen::Vector3f(-0.3f, 0.6f, -1).normalized();
  spot.cos_full = 0.95f;
  spot.cos_none = 0.85f;
  add("spot", lambert(0.6f), lambert(0.7f)).lamps = {spot};
  relight::ReferenceScene& outside = add("environment picture", lambert(0.6f), plastic());
  outside.lamps.clear();
  outside.environment.radiance = capture::Image<float>(16, 8, 3, 0.2f);
  for (int c = 0; c < 3; ++c) outside.environment.radiance.at(6, 1, c) = 12.0f - 3 * static_cast<float>(c);
  add("two lamps in a sealed box", lambert(0.5f), lambert(0.5f))
      .real.push_back(mesh_of(box({-1.2f, -1.9f, -0.1f}, {1.2f, 1.2f, 1.6f}), lambert(0.5f)));
  all.back().scene.lamps.push_back(panel({-0.4f, -0.6f, 1.5f}, 0.2f, 0.2f, 10));
  return all;
}

TEST(ReferenceChange, MeanIsTheDifferenceOfTwoPictures) {
  for (const Case& c : cases()) {
    SCOPED_TRACE(c.name);
    const Compared both = compare(c.scene);
    const std::size_t values = both.change.mean.size();
    double chi2 = 0, affected = 0;
    for (std::size_t i = 0; i < values; ++i) {
      const double error2 = (both.change.variance[i] + both.difference.variance[i]) / kPictures;
      const double z = (both.change.mean[i] - both.difference.mean[i]) / std::sqrt(error2);
      if (i + 3 >= values) {
        EXPECT_LT(std::abs(z), 4) << "mean over the picture, channel " << i + 3 - values;
      } else {
        chi2 += z * z;
        affected += both.change.mean[i] * both.change.mean[i];
      }
    }
    // Student's t of 22 degrees of freedom has a variance of 1.1; skewed samples increase it a little.
    EXPECT_LT(chi2 / static_cast<double>(values - 3), 1.35);
    EXPECT_GT(affected, 0);
    const double change = rms(both.change.variance), difference = rms(both.difference.variance);
    EXPECT_LT(change, difference);
    std::printf("  %-28s error of L_delta %.5f, of the difference %.5f: %.1f times fewer samples\n", c.name, change,
                difference, std::pow(difference / change, 2));
  }
}

TEST(ReferenceChange, ObjectsAreAsInTheOrdinaryImage) {
  const relight::ReferenceScene scene = cases()[3].scene;
  const relight::DeltaPathTracer tracer = tracer_of(scene);
  const relight::ReferencePicture change = tracer.change(from_above(), samples_of(256));
  const capture::Image<float> with = tracer.radiance(from_above(), samples_of(256, 1), true);
  double object = 0, ordinary = 0;
  for (std::size_t i = 0; i < change.coverage.data.size(); ++i) {
    if (change.coverage.data[i] < 1) continue;
    object += change.object.data[3 * i];
    ordinary += with.data[3 * i];
  }
  EXPECT_GT(object, 0);
  EXPECT_NEAR(object, ordinary, 0.01 * ordinary);
}

TEST(ReferenceChange, StrangeScenesStayFinite) {
  const auto all_finite = [](const relight::ReferenceScene& scene) {
    const relight::ReferencePicture picture = tracer_of(scene).change(from_above(), samples_of(32));
    for (const capture::Image<float>* image : {&picture.change, &picture.object, &picture.coverage}) {
      for (const float value : image->data) {
        if (!std::isfinite(value)) return false;
      }
    }
    return true;
  };
  relight::ReferenceScene scene = cases()[0].scene;
  scene.objects.push_back(ball(3, {0, 0, 0}, lambert(1)));
  EXPECT_TRUE(all_finite(scene)) << "an object around the camera";
  scene = cases()[0].scene;
  scene.objects.push_back(ball(0.2f, scene.lamps[0].centre_m, lambert(0.5f)));
  EXPECT_TRUE(all_finite(scene)) << "a lamp inside an object";
  scene = corner(metal(1, 0), metal(1, 0));
  scene.lamps = {bulb({0.4f, -0.3f, 1.1f}, 1e-4f, 1e6f)};
  EXPECT_TRUE(all_finite(scene)) << "mirrors and nearly a point";
  scene = cases()[0].scene;
  scene.objects.push_back(mesh_of({{0, 0, 0.5f}, {0, 0, 0.5f}, {0.1f, 0, 0.5f}}, lambert(0.5f)));
  EXPECT_TRUE(all_finite(scene)) << "a triangle of no area";
  scene.real.clear();
  scene.lamps.clear();
  EXPECT_TRUE(all_finite(scene)) << "nothing real";
  scene.objects.clear();
  EXPECT_TRUE(all_finite(scene)) << "nothing at all";
}

TEST(ReferenceChange, SameBytesEachTimeOnAnyNumberOfThreads) {
  const relight::DeltaPathTracer tracer = tracer_of(cases()[3].scene);
  relight::ReferenceSamples samples = samples_of(8);
  cpu_set_t all, one;
  ASSERT_EQ(sched_getaffinity(0, sizeof all, &all), 0);
  CPU_ZERO(&one);
  CPU_SET(sched_getcpu(), &one);
  ASSERT_EQ(sched_setaffinity(0, sizeof one, &one), 0);
  const relight::ReferencePicture first = tracer.change(from_above(), samples);
  ASSERT_EQ(sched_setaffinity(0, sizeof all, &all), 0);
  const relight::ReferencePicture again = tracer.change(from_above(), samples);
  EXPECT_EQ(first.change.data, again.change.data);
  EXPECT_EQ(first.object.data, again.object.data);
  EXPECT_EQ(first.coverage.data, again.coverage.data);
  samples.seed = 1;
  EXPECT_NE(first.change.data, tracer.change(from_above(), samples).change.data);
}

}  // namespace
}  // namespace lumigraft::test
