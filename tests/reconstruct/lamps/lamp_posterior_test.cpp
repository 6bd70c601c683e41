// Lamps from the shading of a room: the posterior, and the last one as prior of the next.
#include "reconstruct/lamps/lamp_posterior.h"

#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <map>
#include <optional>
#include <random>
#include <utility>

#include "reconstruct/field/field_rays.h"
#include "reconstruct/field/real_surface_mesh.h"
#include "reconstruct/lamps/lamp_memory.h"
#include "reconstruct/lamps/lamp_placement.h"
#include "reconstruct/lamps/parameters.h"
#include "reconstruct/shading/irradiance.h"
#include "tests/reconstruct/albedo/albedo_room.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Vector3f;

/// A floor of one albedo with a box, lit by one bulb.
struct Scene {
  TestRoom room;
  std::optional<DistanceField> field;
  std::optional<FieldRays> rays;
  MetalMask metal{capture::Session()};
  Illumination light;
  std::optional<IrradianceModel> irradiance;
  std::vector<SurfaceSample> samples;
  std::vector<Vector3f> gathered;
  std::optional<ShadingModel> model;

  explicit Scene(const Vector3f& lamp_m, bool clipped = false) {
    room.boxes = {{{0.1f, 0.1f, 0.0f}, {0.2f, 0.2f, 0.15f}}};
    room.lamps = {{lamp_m, {2, 2, 2}, 0.02f}};
    room.ambient = Vector3f::Constant(0.1f);
    field = room.field();
    rays.emplace(*field);
    light = room.illumination();
    light.lights[0].clipped = clipped;
    irradiance.emplace(*field, *rays, metal, light);
    for (float x = -0.5f; x < 0.5f; x += 0.04f) {
      for (float y = -0.5f; y < 0.5f; y += 0.04f) {
        const Vector3f at(x, y, 0);
        if (room.distance(at + 0.01f * Vector3f::UnitZ()) < 0) continue;
        samples.push_back({at, Vector3f::UnitZ(),
                           room.albedo(at).cwiseProduct(room.irradiance(at, Vector3f::UnitZ())) / kTestPi, 0.04f});
        gathered.push_back(kTestPi * room.ambient);
      }
    }
    model.emplace(*irradiance, light, samples, gathered);
  }
  LampPosterior solve(double start, const LampPrior* prior = nullptr) {
    const std::vector<SamplePair> pairs = choose_pairs(samples);
    model->tabulate(0, {start - 0.3, start - 0.15, start, start + 0.15, start + 0.3}, 5);
    return solve_lamps(*model, pairs, -1, {{.inverse_distance = start}}, Search::fine, prior);
  }
};

TEST(LampPosterior, DistanceOfNearAndFarLamps) {
  for (const Vector3f& lamp_m : {Vector3f(0.5f, -0.3f, 0.8f), Vector3f(0.8f, -0.6f, 1.6f), Vector3f(4, -3, 6)}) {
    Scene scene(lamp_m);
    const double truth = 1 / (lamp_m - scene.room.probe).norm();
    const LampPosterior found = scene.solve(truth + 0.1);
    const double error = found.shapes[0].inverse_distance - truth, sigma = found.inverse_distance_sigma(0);
    EXPECT_LT(std::abs(error), 0.03) << "1/m, of " << truth;
    EXPECT_LT(std::abs(error), 3 * sigma);
    EXPECT_LT(sigma, 0.2);
  }
}

/// A lamp that shading does not determine.
PointLight faint_lamp(const Vector3f& direction, bool clipped) {
  PointLight light;
  light.id = 1;
  light.direction = direction.normalized();
  light.irradiance = Vector3f::Constant(1e-4f);
  light.angular_radius_rad = 0.02f;
  light.clipped = clipped;
  return light;
}

TEST(LampPosterior, UndeterminedLampsHangAtTheUsualHeight) {
  for (const Vector3f& direction : {Vector3f(0.1f, 0.1f, 1), Vector3f(1, 0, 0.3f), Vector3f(1, 1, -0.2f)}) {
    Scene scene({0.5f, -0.3f, 0.8f});
    scene.light.lights = {faint_lamp(direction, false)};
    scene.model.emplace(*scene.irradiance, scene.light, scene.samples, scene.gathered);
    const LampPosterior found = scene.solve(0.6);
    const double expected = kLampParameters.posterior.inverse_height * std::max(0.0f, direction.normalized().z());
    EXPECT_NEAR(found.shapes[0].inverse_distance, expected, 0.01) << direction.transpose();
    EXPECT_GT(found.inverse_distance_sigma(0), 0.3) << "it remains uncertain";
  }
}

TEST(LampPosterior, ClippedLampsOfAKindHangAtOneHeightAndHaveOneColour) {
  const Vector3f lamp_m(0.2f, -0.1f, 0.9f);
  Scene scene(lamp_m, true);
  scene.light.lights.push_back(faint_lamp({0.5f, 0.5f, 1}, true));
  scene.light.lights[1].irradiance = 1e-4f * Vector3f(1, 0.25f, 0.25f);  // green and blue clip more than red
  // Of equal radiance it is faint, too.
  scene.light.lights[1].angular_radius_rad =
      scene.light.lights[0].angular_radius_rad * std::sqrt(1e-4f / scene.light.lights[0].irradiance.x());
  scene.model.emplace(*scene.irradiance, scene.light, scene.samples, scene.gathered);
  const auto inverse_height = [&](const LampPosterior& found, std::size_t lamp) {
    return found.shapes[lamp].inverse_distance / scene.light.lights[lamp].direction.z();
  };
  const auto ratio = [&](const LampPosterior& found, std::size_t lamp) {  // of red to green
    return std::log(scene.light.lights[lamp].irradiance.x() / scene.light.lights[lamp].irradiance.y()) +
           found.shapes[lamp].log_gain[0] - found.shapes[lamp].log_gain[1];
  };
  const double truth = 1 / (lamp_m - scene.room.probe).norm();
  scene.model->tabulate(0, {truth - 0.2, truth - 0.1, truth, truth + 0.1, truth + 0.2}, 5);
  scene.model->tabulate(1, {0}, 1);
  const auto solve = [&](bool same_kind) {
    return solve_lamps(*scene.model, choose_pairs(scene.samples), -1,
                       {{.inverse_distance = truth}, {.inverse_distance = 0.3, .flat = !same_kind}}, Search::fine);
  };
  const LampPosterior alike = solve(true), other = solve(false);
  const double usual = kLampParameters.posterior.inverse_height;
  ASSERT_GT(inverse_height(alike, 0), usual + 0.4);
  EXPECT_NEAR(inverse_height(alike, 1), inverse_height(alike, 0), 0.2);
  EXPECT_NEAR(inverse_height(other, 1), usual, 0.1);
  EXPECT_LT(std::abs(ratio(alike, 1) - ratio(alike, 0)), 0.7 * std::abs(ratio(other, 1) - ratio(other, 0)));
}

TEST(LampPosterior, FaintLampsAreNeitherSearchedNorInfinitelyFar) {
  Scene scene({0.5f, -0.3f, 0.8f});
  scene.light.lights.push_back(faint_lamp({0.5f, 0.5f, 1}, false));
  LampMemory memory;
  const std::vector<LampEstimate> found =
      locate_lamps(*scene.irradiance, scene.light, scene.samples, scene.gathered, std::nullopt, {}, memory);
  EXPECT_NEAR(found[0].distance_m, (Vector3f(0.5f, -0.3f, 0.8f) - scene.room.probe).norm(), 0.03);
  EXPECT_FALSE(found[1].far);
  EXPECT_NEAR(found[1].distance_m * scene.light.lights[1].direction.z(), 1 / kLampParameters.posterior.inverse_height,
              0.1);
  EXPECT_GT(found[1].log_sigma, 0.5);
}

TEST(LampPosterior, InformationIsTheCurvatureOfItsOwnCost) {
  Scene scene({0.5f, -0.3f, 0.8f});
  const LampPosterior best = scene.solve(1 / (Vector3f(0.5f, -0.3f, 0.8f) - scene.room.probe).norm());
  // -log p of the pairs at some distances, without a solution: 1/2v Σ ρ.
  const auto cost = [&](double inverse) {
    std::vector<float> factors;
    scene.model->factors(0, {.inverse_distance = inverse}, factors);
    std::vector<Eigen::Array3f> log_albedo;
    scene.model->log_albedo({scene.model->power(0, {})}, {factors}, log_albedo);
    return robust_cost(log_albedo, choose_pairs(scene.samples), 1) / (2 * best.pair_variance);
  };
  const double at = best.shapes[0].inverse_distance, step = 0.04,
               sigma = kLampParameters.posterior.inverse_distance_sigma;
  const double curvature = (cost(at + step) - 2 * cost(at) + cost(at - step)) / (step * step) + 1 / (sigma * sigma);
  EXPECT_NEAR(best.information(0, 0) / curvature, 1, 0.2);
}

/// Solutions of one lamp in rooms whose albedo varies.
struct Textured {
  static constexpr int kRooms = 12;
  double error_sigmas = 0;  ///< RMS error over sigma
  double sigma = 0;         ///< mean, 1/m

  /// `texture`: log albedo at a position in one of the rooms.
  explicit Textured(const std::function<float(int room, const Vector3f& position)>& texture) {
    const Vector3f lamp_m(0.5f, -0.3f, 0.8f);
    for (int i = 0; i < kRooms; ++i) {
      Scene scene(lamp_m);
      const double truth = 1 / (lamp_m - scene.room.probe).norm();
      for (SurfaceSample& sample : scene.samples) sample.radiance *= std::exp(texture(i, sample.position));
      scene.model.emplace(*scene.irradiance, scene.light, scene.samples, scene.gathered);
      const LampPosterior found = scene.solve(truth);
      const double own = found.inverse_distance_sigma(0);
      error_sigmas += std::pow((found.shapes[0].inverse_distance - truth) / own, 2) / kRooms;
      sigma += own / kRooms;
    }
    error_sigmas = std::sqrt(error_sigmas);
  }
};

TEST(LampPosterior, OwnTextureOfSamplesAveragesOutAndThatOfPlanksDoesNot) {
  constexpr float kAmplitude = 0.1f, kPlank_m = 0.15f;
  std::mt19937 random(7);
  const auto uniform = [&] { return static_cast<float>(random()) / static_cast<float>(std::mt19937::max()); };
  const Textured grain([&](int, const Vector3f&) { return kAmplitude * std::sqrt(3.0f) * (2 * uniform() - 1); });
  std::map<std::pair<int, int>, float> tones;  // of a room's planks
  const Textured planks([&](int room, const Vector3f& position) {
    const auto plank = static_cast<int>(std::floor(position.x() / kPlank_m));
    return tones.try_emplace({room, plank}, kAmplitude * std::sqrt(3.0f) * (2 * uniform() - 1)).first->second;
  });
  EXPECT_GT(grain.error_sigmas, 0.4);
  EXPECT_LT(grain.error_sigmas, 1.4);
  EXPECT_LT(grain.sigma, 0.03) << "1/m; 0.05 if the texture of all samples were one error";
  EXPECT_LT(planks.error_sigmas, 2);
  EXPECT_GT(planks.sigma, 1.15 * grain.sigma) << "fewer independent pieces";
}

TEST(LampPosterior, EarlierSolutionsHoldUnlessContradicted) {
  const Vector3f lamp_m(0.5f, -0.3f, 0.8f);
  Scene scene(lamp_m);
  const double truth = 1 / (lamp_m - scene.room.probe).norm();
  LampPrior prior{Eigen::VectorXd::Zero(kUnknownsPerLamp), Eigen::MatrixXd::Zero(kUnknownsPerLamp, kUnknownsPerLamp)};
  const double own_sigma = scene.solve(truth).inverse_distance_sigma(0);
  prior.information(0, 0) = 4 / (own_sigma * own_sigma);
  prior.mean[0] = truth + own_sigma;
  const double drawn = scene.solve(truth, &prior).shapes[0].inverse_distance;
  EXPECT_GT(drawn, truth + 0.5 * own_sigma) << "within its noise the earlier ones count";
  prior.mean[0] = truth + 100 * own_sigma;
  prior.information(0, 0) = 100 / (own_sigma * own_sigma);
  EXPECT_NEAR(scene.solve(truth, &prior).shapes[0].inverse_distance, truth, own_sigma);
}

TEST(LampMemory, RemembersPowerAndPlaceOfALampThatStays) {
  Scene scene({0.5f, -0.3f, 0.8f}, true);
  LampPosterior found;
  found.shapes = {{.inverse_distance = 0.9, .log_gain = {1, 1, 1}}};
  found.with_prior = 100 * Eigen::MatrixXd::Identity(kUnknownsPerLamp, kUnknownsPerLamp);
  LampMemory memory;
  EXPECT_FALSE(memory.prior(*scene.model, found.shapes)) << "nothing is remembered";
  memory.keep(*scene.model, found);

  // The next image clips half of what this one does: the gain is twice, the power the same.
  Illumination next = scene.light;
  next.lights[0].irradiance *= 0.5f;
  const ShadingModel again(*scene.irradiance, next, scene.samples, scene.gathered);
  const auto prior = memory.prior(again, found.shapes);
  ASSERT_TRUE(prior);
  EXPECT_NEAR(prior->mean[0], 0.9, 1e-9);
  EXPECT_NEAR(prior->mean[3], 1 + std::log(2), 1e-5);
  EXPECT_NEAR(prior->information(0, 0), 100 * kLampParameters.memory.kept, 1e-6);
  memory.outweigh(0.5);  // of less surface nothing is forgotten
  EXPECT_EQ(memory.prior(again, found.shapes)->information, prior->information);
  memory.outweigh(4);
  EXPECT_NEAR(memory.prior(again, found.shapes)->information(0, 0), 25 * kLampParameters.memory.kept, 1e-6);

  EXPECT_FALSE(memory.prior(again, {{.flat = true}})) << "another shape";
}

TEST(LampMemory, RemembersTheIntensityOfALampThatIsCarried) {
  Scene scene({0.5f, -0.3f, 0.8f});
  LampPosterior found;
  found.shapes = {{.inverse_distance = 0.8, .flat = true, .tilt = {0.3, 0}}};
  found.with_prior = 1e8 * Eigen::MatrixXd::Identity(kUnknownsPerLamp, kUnknownsPerLamp);
  LampMemory memory;
  memory.keep(*scene.model, found);
  const auto prior = [&](const Vector3f& direction, float factor, const LampShape& shape) {
    Illumination next = scene.light;
    next.lights[0].direction = direction.normalized();
    next.lights[0].irradiance *= factor;
    return memory.prior(ShadingModel(*scene.irradiance, next, scene.samples, scene.gathered), {shape});
  };
  const Vector3f was = scene.light.lights[0].direction, around(-was.y(), was.x(), was.z());
  // Half as near, and turned to the probe: E d² / cos(tilt) is as before.
  const auto factor = static_cast<float>(0.25 / std::sqrt(1 / (1 + 0.3 * 0.3)));
  const auto carried = prior(around, factor, {.inverse_distance = 0.5, .flat = true});
  ASSERT_TRUE(carried);
  EXPECT_EQ(carried->information.norm(), 0) << "of its place nothing is known";
  ASSERT_EQ(carried->intensities.size(), 1u);
  const auto sigmas = [](const LampPrior& of, double inverse_distance) {
    Eigen::VectorXd unknowns = Eigen::VectorXd::Zero(kUnknownsPerLamp);
    unknowns[0] = inverse_distance;
    return std::abs((of.intensities[0].a * unknowns - of.intensities[0].b)[0]);
  };
  EXPECT_LT(sigmas(*carried, 0.4), 0.01);
  // By a hand that turns it, over a quarter of a circle; 1 % of distance are 2 % of intensity.
  const double turned = std::acos(was.dot(around));
  EXPECT_NEAR(0.02 / sigmas(*carried, 0.404), std::hypot(0.01, 0.03 * turned), 1e-3);
  // Upwards bulbs emit otherwise.
  const double up = std::asin(was.z());
  const auto raised = prior({was.x(), was.y(), was.head<2>().norm() * static_cast<float>(std::tan(up + 0.2))}, 1,
                            {.inverse_distance = 0.8, .flat = true});
  EXPECT_NEAR(0.01 / sigmas(*raised, raised->intensities[0].b[0] / raised->intensities[0].a(0, 0) * 1.005),
              std::hypot(0.01, 0.13 * 0.2, 0.03 * 0.2), 1e-3);
  EXPECT_FALSE(prior(was, 0.5f, found.shapes[0])) << "it was dimmed";
}

/// A lamp at `position_m` as large as the scene's.
KeptLamp kept_lamp(const Scene& scene, const Vector3f& position_m) {
  const float distance_m = (position_m - scene.room.probe).norm();
  return {position_m, distance_m * std::tan(scene.light.lights[0].angular_radius_rad), 0.03f};
}

TEST(LampMemory, AKeptPlaceIsAPriorOfALampAsLargeInItsDirection) {
  const Vector3f lamp_m(0.5f, -0.3f, 0.8f);
  const Scene scene(lamp_m);
  const double truth = 1 / (lamp_m - scene.room.probe).norm();
  const KeptLamp kept = kept_lamp(scene, lamp_m);
  const std::vector<LampShape> bulb = {{.inverse_distance = 1}};
  const auto prior_with = [&](const KeptLamp& lamp, const std::vector<LampShape>& shapes) {
    LampMemory memory;
    memory.restore({lamp});
    return memory.prior(*scene.model, shapes);
  };
  const auto prior = prior_with(kept, bulb);
  ASSERT_TRUE(prior);
  EXPECT_NEAR(prior->mean[0], truth, 1e-6);
  const double sigma = truth * std::hypot(0.03, double{kLampParameters.memory.kept_log_sigma});
  EXPECT_NEAR(prior->information(0, 0) * sigma * sigma, 1, 1e-4);
  EXPECT_EQ((prior->information.array() != 0).count(), 1) << "tilt and power are not kept";

  KeptLamp other = kept;
  other.radius_m *= 1.3f;
  EXPECT_FALSE(prior_with(other, bulb)) << "a larger lamp";
  other = kept;
  other.position_m.x() += 0.1f;
  EXPECT_FALSE(prior_with(other, bulb)) << "elsewhere";
  EXPECT_FALSE(prior_with(kept, {{.inverse_distance = 1, .flat = true}})) << "another shape";

  LampMemory memory;
  memory.restore({kept, other});
  LampPosterior found;
  found.shapes = {{.inverse_distance = 0.5}};
  found.with_prior = 100 * Eigen::MatrixXd::Identity(kUnknownsPerLamp, kUnknownsPerLamp);
  memory.keep(*scene.model, found);
  EXPECT_NEAR(memory.prior(*scene.model, found.shapes)->mean[0], 0.5, 1e-9) << "this run knows better";
  ASSERT_EQ(memory.kept().size(), 1u) << "the other did not shine yet";
  EXPECT_EQ(memory.kept()[0].position_m, other.position_m);
}

TEST(LampMemory, AWrongKeptPlaceIsOverruledAndAFaintLampIsFoundAtItsOwn) {
  const Vector3f lamp_m(0.5f, -0.3f, 0.8f);
  Scene scene(lamp_m);
  scene.light.lights.push_back(faint_lamp({0.5f, 0.5f, 1}, false));
  const float faint_m = 0.7f;
  const PointLight& faint = scene.light.lights[1];
  const Vector3f way = lamp_m - scene.room.probe;
  LampMemory memory;
  memory.restore({kept_lamp(scene, scene.room.probe + 1.5f * way),
                  {scene.room.probe + faint_m * faint.direction, faint_m * std::tan(faint.angular_radius_rad), 0.05f}});
  const std::vector<LampEstimate> found =
      locate_lamps(*scene.irradiance, scene.light, scene.samples, scene.gathered, std::nullopt, {}, memory);
  EXPECT_NEAR(found[0].distance_m, way.norm(), 0.03) << "shading determines it";
  EXPECT_NEAR(found[1].distance_m, faint_m, 0.02) << "shading does not; it hangs where it hung";
}

}  // namespace
}  // namespace lumigraft::reconstruct
