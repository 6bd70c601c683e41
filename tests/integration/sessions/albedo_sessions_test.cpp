// Lamps and albedo of recorded sessions against their truth.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>

#include "capture/formats/picture_file.h"
#include "capture/session/session.h"
#include "capture/source.h"
#include "reconstruct/albedo/albedo.h"
#include "reconstruct/fusion/fusion.h"
#include "reconstruct/light/environment.h"
#include "reconstruct/light/light.h"
#include "reconstruct/pose/pose.h"
#include "tests/integration/sessions/recorded_session.h"
#include "tests/reconstruct/albedo/albedo_agreement.h"
#include "tests/reconstruct/albedo/albedo_room.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Vector3f;
using test::folder_of;

constexpr float kDegree_rad = 0.0174533f;

struct TrueLamp {
  Vector3f centre;
  std::optional<Vector3f> normal;
  Vector3f radiance;
  float area_m2 = 0;  ///< of the lamp facing the viewer

  /// Irradiance at a point, facing the lamp, unoccluded.
  Vector3f at(const Vector3f& point) const {
    const Vector3f way = point - centre;
    const float cosine = normal ? std::max(0.0f, normal->dot(way.normalized())) : 1.0f;
    return radiance * (area_m2 * cosine / way.squaredNorm());
  }
};

Vector3f vector(const nlohmann::json& j) { return {j[0].get<float>(), j[1].get<float>(), j[2].get<float>()}; }

std::vector<TrueLamp> true_lamps(const std::filesystem::path& session) {
  std::ifstream in(session / "truth/000000/lights.json");
  std::vector<TrueLamp> lamps;
  const nlohmann::json document = nlohmann::json::parse(in);
  for (const auto& j : document["lights"]) {
    TrueLamp lamp;
    lamp.centre = vector(j["centre"]);
    lamp.radiance = vector(j["radiance"]);
    if (j["kind"] == "bulb") {
      lamp.area_m2 = 3.14159265f * j["radius"].get<float>() * j["radius"].get<float>();
    } else {
      lamp.area_m2 = j["area_m2"].get<float>();
      lamp.normal = vector(j["normal"]).normalized();
    }
    lamps.push_back(lamp);
  }
  return lamps;
}

float angle_deg(const Vector3f& a, const Vector3f& b) {
  return std::acos(std::clamp(a.normalized().dot(b.normalized()), -1.0f, 1.0f)) / kDegree_rad;
}

/// Errors over all pixels with known albedo.
struct AlbedoErrors {
  double mean = 0;              ///< absolute error over all channels
  double relative = 0;          ///< median of |error| / |truth|
  double chromaticity_deg = 0;  ///< median angle between colours
  double within_sigma = 0;      ///< fraction of pixels with an RMS error over channels within the reported 1σ
  double unknown = 0;           ///< fraction of all pixels
  double sigma = 0;             ///< median of reported 1σ / |truth|, over all channels
};

AlbedoErrors albedo_errors(const AlbedoField& field, const capture::Image<float>& truth, const capture::FrameSet& frame,
                           const capture::Session& session, const Pose& pose) {
  AlbedoErrors errors;
  std::vector<double> relative, chromaticity, sigmas;
  int within = 0, unknown = 0;
  for (int v = 0; v < truth.height; ++v) {
    for (int u = 0; u < truth.width; ++u) {
      const float depth = frame.depth->depth_m.at(u, v);
      const auto ray = session.color.model.unproject(Eigen::Vector2d(u, v));
      if (depth <= 0 || !ray) continue;
      const Eigen::Vector3d point = pose.T_tag_camera * (*ray * (depth / ray->z()));
      const auto [albedo, sigma] = albedo_at(field, point.cast<float>());
      if (sigma < 0) {
        ++unknown;
        continue;
      }
      const Vector3f exact(truth.at(u, v, 0), truth.at(u, v, 1), truth.at(u, v, 2)), off = albedo - exact;
      errors.mean += off.cwiseAbs().mean();
      within += off.norm() < std::sqrt(3.0f) * sigma;
      // The tag's ink and metal are black: relative errors are meaningless.
      if (exact.maxCoeff() < 0.03f) continue;
      relative.push_back(off.norm() / exact.norm());
      chromaticity.push_back(angle_deg(albedo, exact));
      sigmas.push_back(std::sqrt(3.0) * sigma / exact.norm());
    }
  }
  const auto median = [](std::vector<double>& values) {
    if (values.empty()) return 0.0;
    const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
    std::nth_element(values.begin(), middle, values.end());
    return *middle;
  };
  const int pixels = truth.width * truth.height, known = pixels - unknown;
  errors.mean /= std::max(known, 1);
  errors.relative = median(relative);
  errors.chromaticity_deg = median(chromaticity);
  errors.sigma = median(sigmas);
  errors.within_sigma = static_cast<double>(within) / std::max(known, 1);
  errors.unknown = static_cast<double>(unknown) / pixels;
  return errors;
}

/// Relative RMS error over normals of the residual's irradiance: its harmonics against quadrature over the true
/// fish-eye picture with the true lamps removed.
double remainder_error(const Illumination& light, const std::vector<TrueLamp>& lamps, const capture::Session& session,
                       capture::Image<float> truth) {
  const FisheyeView view = fisheye_view(*session.fisheye);
  const Vector3f probe = light.probe_position_m;
  for (const TrueLamp& lamp : lamps) {
    const float radius = std::sqrt(lamp.area_m2 / 3.14159265f) / (lamp.centre - probe).norm();
    const Vector3f direction = (lamp.centre - probe).normalized();
    std::vector<std::size_t> on;
    Vector3f around = Vector3f::Zero();
    int count = 0;
    for (std::size_t i = 0; i < view.direction.size(); ++i) {
      const float angle = view.sees(i) ? kDegree_rad * angle_deg(view.direction[i], direction) : 10;
      if (angle < 1.8f * radius + 0.02f) {
        on.push_back(i);
      } else if (angle < 1.8f * radius + 0.04f) {
        around += Eigen::Map<const Vector3f>(&truth.data[3 * i]);
        ++count;
      }
    }
    for (const std::size_t i : on) Eigen::Map<Vector3f>(&truth.data[3 * i]) = around / std::max(count, 1);
  }
  const EnvironmentMap exact = EnvironmentResampler(*session.fisheye, view, 128, 64).resample(truth, view);
  double squares = 0, sum = 0;
  constexpr int kNormals = 60;
  for (int i = 0; i < kNormals; ++i) {  // Fibonacci spiral
    const float z = 1 - (2 * i + 1.0f) / kNormals, r = std::sqrt(1 - z * z), phi = 2.39996323f * static_cast<float>(i);
    const Vector3f normal(r * std::cos(phi), r * std::sin(phi), z);
    Vector3f irradiance = Vector3f::Zero();
    for (int v = 0; v < 64; ++v) {
      for (int u = 0; u < 128; ++u) {
        const float cosine = normal.dot(environment_direction(u, v, 128, 64));
        if (cosine <= 0) continue;
        irradiance += cosine * environment_solid_angle_sr(v, 128, 64) *
                      Eigen::Map<const Vector3f>(&exact.radiance.data[exact.radiance.index(u, v)]);
      }
    }
    squares += (sh_irradiance(light.environment_sh, normal) - irradiance).squaredNorm() / 3;
    sum += irradiance.mean();
  }
  return std::sqrt(squares / kNormals) / (sum / kNormals);
}

/// Sessions with a radiance fish-eye have no separate truth of it.
capture::Image<float> true_fisheye(const std::filesystem::path& session) {
  const std::filesystem::path truth = session / "truth/000000/fisheye.exr";
  return capture::read_radiance(std::filesystem::exists(truth) ? truth : session / "fisheye/000000.exr");
}

struct Case {
  const char* session;
  const char* fisheye;  ///< fish-eye picture list; empty = the session's own
  int frames;
  float direction_deg;  ///< bound on the error of a lamp's direction at the object
  float ratio;          ///< bound on the relative error of its irradiance there
  double albedo;        ///< bound on the mean error over the first frame's pixels
};

void PrintTo(const Case& c, std::ostream* out) { *out << c.session << " " << c.fisheye; }

class AlbedoSessions : public testing::TestWithParam<Case> {};

TEST_P(AlbedoSessions, LampsAndAlbedoAreNearTheTruth) {
  const Case& c = GetParam();
  const std::filesystem::path folder = folder_of(c.session);
  if (!std::filesystem::exists(folder / "session.toml")) {
    GTEST_SKIP() << "LUMIGRAFT_EXTRA names no folder with sessions/" << c.session;
  }
  std::vector<std::string> overrides;
  if (*c.fisheye) overrides.push_back(std::string("fisheye.source=images:") + c.fisheye);
  const capture::Session session =
      capture::read_session(capture::ConfigTable::load(folder / "session.toml", overrides));
  const auto frames = capture::open_frames(session);
  PoseStage locate(session.tag, session.color.model, session.color.response);
  FusionStage fuse(session, {});
  LightStage light(session);
  std::optional<Pose> pose, first_pose;
  std::optional<capture::FrameSet> frame, first;
  std::shared_ptr<const DistanceField> field;
  LightStage::Result lights;
  for (int i = 0; i < c.frames; ++i) {
    auto next = frames->next(std::chrono::seconds(1));
    ASSERT_TRUE(next);
    frame = std::move(next);
    pose = locate.locate(*frame).pose;
    ASSERT_TRUE(pose);
    field = fuse.fuse(*frame, *pose);
    lights = light.extract(*frame);
    if (!first) {
      first = frame;
      first_pose = pose;
    }
  }
  AlbedoStage solve(session);
  const std::clock_t start = std::clock();
  const auto result = solve.solve(*field, *lights.illumination);
  const double ms = 1e3 * static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;

  // A point above the tag's far edge, where objects stand in these sessions.
  const Vector3f object(0.05f, 0.3f, 0.1f);
  const Vector3f probe = result.illumination->probe_position_m;
  std::printf("lamps: %-16s %-18s %4.0f CPU ms\n", c.session, c.fisheye, ms);
  const std::vector<TrueLamp> truth = true_lamps(folder);
  EXPECT_EQ(result.illumination->lights.size(), truth.size());
  for (const TrueLamp& lamp : truth) {
    const auto& found = result.illumination->lights;
    const auto nearest = std::min_element(found.begin(), found.end(), [&](const PointLight& a, const PointLight& b) {
      return angle_deg(a.direction, lamp.centre - probe) < angle_deg(b.direction, lamp.centre - probe);
    });
    ASSERT_NE(nearest, found.end());
    EXPECT_LT(angle_deg(nearest->direction, lamp.centre - probe), 0.6);
    ASSERT_TRUE(nearest->distance_known);
    const Vector3f way = object - nearest->position_m;
    const Vector3f irradiance = nearest->intensity * (nearest->emission(way.normalized()) / way.squaredNorm());
    const float at_object_deg = angle_deg(way, object - lamp.centre);
    const float ratio = irradiance.sum() / lamp.at(object).sum();
    const float distance = (nearest->position_m - probe).norm() / (lamp.centre - probe).norm();
    const Vector3f power = nearest->irradiance.cwiseQuotient(lamp.at(probe)) - Vector3f::Ones();
    if (nearest->clipped) {
      EXPECT_LT(std::abs(std::log1p(power.mean())), 2 * nearest->power_log_sigma) << "says how sure it is";
    } else {
      EXPECT_LT(power.cwiseAbs().maxCoeff(), 0.05);
    }
    const Vector3f to_tag = -nearest->position_m;
    const Vector3f at_tag = (nearest->intensity * (nearest->emission(to_tag.normalized()) / to_tag.squaredNorm()))
                                .cwiseQuotient(lamp.at(Vector3f::Zero())) -
                            Vector3f::Ones();
    std::printf(
        "    direction %.2f deg off, distance %+.1f %%, irradiance at the probe %+.1f %+.1f %+.1f %%, at the tag "
        "%+.1f %+.1f %+.1f %%; at the object %.2f deg off, irradiance %+.1f %% (sigma %.1f %% of power, %.1f %% of "
        "distance)%s\n",
        angle_deg(nearest->direction, lamp.centre - probe), 100 * (distance - 1), 100 * power.x(), 100 * power.y(),
        100 * power.z(), 100 * at_tag.x(), 100 * at_tag.y(), 100 * at_tag.z(), at_object_deg, 100 * (ratio - 1),
        100 * nearest->power_log_sigma, 100 * nearest->distance_log_sigma, nearest->clipped ? "   (clipped)" : "");
    EXPECT_NEAR(distance, 1, nearest->clipped ? 0.25f : 0.2f);
    EXPECT_EQ(nearest->flat, lamp.normal.has_value());
    EXPECT_LT(at_object_deg, c.direction_deg);
    EXPECT_NEAR(ratio, 1, c.ratio);
  }
  const double remainder = remainder_error(*result.illumination, truth, session, true_fisheye(folder));
  std::printf("    remainder: irradiance by harmonics %.1f %% off, RMS over normals\n", 100 * remainder);
  const AlbedoErrors errors = albedo_errors(*result.albedo, capture::read_radiance(folder / "truth/000000/albedo.exr"),
                                            *first, session, *first_pose);
  std::printf(
      "    albedo: mean error %.4f, median %.1f %%, chromaticity %.2f deg, %.0f %% within one sigma (%.1f %%), %.1f %% "
      "unknown\n",
      errors.mean, 100 * errors.relative, errors.chromaticity_deg, 100 * errors.within_sigma, 100 * errors.sigma,
      100 * errors.unknown);
  if (!result.illumination->lights[0].clipped) {
    EXPECT_LT(remainder, 0.03);
  }
  EXPECT_LT(errors.mean, c.albedo);
  EXPECT_LT(errors.relative, 0.1);
  EXPECT_LT(errors.chromaticity_deg, 2);
  EXPECT_GT(errors.within_sigma, 0.5);  // ideally 0.68; 0.75 over all sessions together
  EXPECT_LT(errors.within_sigma, 0.92);
  EXPECT_LT(errors.sigma, errors.relative + 0.06);
  EXPECT_LT(errors.unknown, 0.03);
}

class AlbedoNewSessions : public testing::TestWithParam<const char*> {};

// A moving camera: solving only new surfaces gives errors as small as solving everything.
TEST_P(AlbedoNewSessions, WhatIsSolvedAloneIsAsNearToTheTruth) {
  const std::filesystem::path folder = folder_of(GetParam());
  if (!std::filesystem::exists(folder / "session.toml")) {
    GTEST_SKIP() << "LUMIGRAFT_EXTRA names no folder with sessions/" << GetParam();
  }
  const capture::Session session = capture::read_session(capture::ConfigTable::load(folder / "session.toml"));
  const auto frames = capture::open_frames(session);
  PoseStage locate(session.tag, session.color.model, session.color.response);
  FusionStage fuse(session, {});
  LightStage light(session);
  AlbedoStage solve(session);
  std::optional<capture::FrameSet> first;
  std::optional<Pose> first_pose;
  std::shared_ptr<const DistanceField> field;
  std::shared_ptr<const Illumination> seen;
  AlbedoStage::Result last;
  int incremental = 0, complete = 0;
  double incremental_ms = 0, complete_ms = 0;
  while (const auto frame = frames->next(std::chrono::seconds(1))) {
    const auto pose = locate.locate(*frame).pose;
    ASSERT_TRUE(pose);
    field = fuse.fuse(*frame, *pose);
    seen = light.extract(*frame).illumination;
    if (!first) {
      first = frame;
      first_pose = pose;
    }
    const std::clock_t start = std::clock();
    last = complete == 0 ? solve.solve(*field, *seen) : *solve.solve_incremental(*field, *seen);
    (last.complete ? complete_ms : incremental_ms) += 1e3 * static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
    ++(last.complete ? complete : incremental);
  }
  const auto all = solve.solve_complete(*field, *seen);
  const Agreement agree = agreement(*last.albedo, *all.albedo);
  std::printf("new: %-16s %d times all, %.0f CPU ms each, %d times what is new, %.0f CPU ms each\n", GetParam(),
              complete, complete_ms / complete, incremental, incremental_ms / std::max(incremental, 1));
  const capture::Image<float> truth = capture::read_radiance(folder / "truth/000000/albedo.exr");
  std::vector<AlbedoErrors> both;
  for (const AlbedoField* albedo : {last.albedo.get(), all.albedo.get()}) {
    const AlbedoErrors errors = albedo_errors(*albedo, truth, *first, session, *first_pose);
    both.push_back(errors);
    std::printf("    median %.1f %%, chromaticity %.2f deg, %.0f %% within one sigma (%.1f %%), %.1f %% unknown\n",
                100 * errors.relative, errors.chromaticity_deg, 100 * errors.within_sigma, 100 * errors.sigma,
                100 * errors.unknown);
  }
  std::printf("    %.1f %% within one sigma of all solved together, mean %.4f, known %.4f\n", 100 * agree.within_sigma,
              agree.mean, agree.known);
  EXPECT_EQ(complete, 1);
  EXPECT_LT(both[0].relative, both[1].relative + 0.01);
  EXPECT_LT(both[0].unknown, both[1].unknown + 0.01);
  EXPECT_NEAR(both[0].within_sigma, both[1].within_sigma, 0.05);
  EXPECT_GT(agree.within_sigma, 0.68);
  EXPECT_NEAR(agree.mean, 1, 0.03);
  EXPECT_GT(agree.known, 0.95);
}
INSTANTIATE_TEST_SUITE_P(All, AlbedoNewSessions, testing::Values("recording", "tabletop-orbit"));

constexpr const char* kClipped = "fisheye-ldr.txt";
INSTANTIATE_TEST_SUITE_P(
    All, AlbedoSessions,
    testing::Values(Case{"tabletop", "", 1, 1.5f, 0.08f, 0.06}, Case{"tabletop", kClipped, 1, 1.5f, 0.09f, 0.05},
                    Case{"cornell", "", 1, 1.0f, 0.06f, 0.04}, Case{"cornell", kClipped, 1, 1.0f, 0.15f, 0.05},
                    Case{"box-with-inside", "", 1, 1.0f, 0.05f, 0.03},
                    Case{"box-with-inside", kClipped, 1, 1.0f, 0.15f, 0.04},
                    Case{"brushed-metal", "", 1, 3.5f, 0.08f, 0.03},
                    Case{"brushed-metal", kClipped, 1, 3.0f, 0.25f, 0.03},
                    Case{"tabletop-orbit", "", 12, 1.5f, 0.15f, 0.05}, Case{"recording", "", 12, 2.0f, 0.1f, 0.06}));

}  // namespace
}  // namespace lumigraft::reconstruct
