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

#include "capture/picture_file.h"
#include "capture/session.h"
#include "capture/source.h"
#include "reconstruct/albedo.h"
#include "reconstruct/fusion.h"
#include "reconstruct/light.h"
#include "reconstruct/pose.h"

namespace lumigraft {
namespace {

using Eigen::Vector3f;

constexpr float kDegree = 0.0174533f;

struct TrueLamp {
  Vector3f centre;
  std::optional<Vector3f> normal;
  Vector3f radiance;
  float area_m2 = 0;  ///< as seen face on

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
  return std::acos(std::clamp(a.normalized().dot(b.normalized()), -1.0f, 1.0f)) / kDegree;
}

/// Mean absolute difference over all pixels whose albedo is known, and the share of those that are not.
std::pair<double, double> albedo_error(const AlbedoField& field, const Image<float>& truth, const FrameSet& frame,
                                       const Session& session, const Pose& pose) {
  double sum = 0;
  int known = 0, unknown = 0;
  for (int v = 0; v < truth.height; ++v) {
    for (int u = 0; u < truth.width; ++u) {
      const float depth = frame.depth->depth_m.at(u, v);
      const auto ray = session.color.model.unproject(Eigen::Vector2d(u, v));
      if (depth <= 0 || !ray) continue;
      const Eigen::Vector3d point = pose.T_tag_camera * (*ray * (depth / ray->z()));
      const Eigen::Vector3i voxel = (point / field.voxel_m).array().round().cast<int>();
      const auto brick = field.bricks.find({voxel.x() >> 3, voxel.y() >> 3, voxel.z() >> 3});
      const int index = (voxel.x() & 7) + 8 * ((voxel.y() & 7) + 8 * (voxel.z() & 7));
      if (brick == field.bricks.end() || brick->second->sigma[index] < 0) {
        ++unknown;
        continue;
      }
      ++known;
      for (int c = 0; c < 3; ++c) sum += std::abs(brick->second->albedo[index][c] - truth.at(u, v, c)) / 3;
    }
  }
  return {sum / std::max(known, 1), static_cast<double>(unknown) / std::max(known + unknown, 1)};
}

struct Case {
  const char* session;
  const char* fisheye;  ///< list of its pictures; empty = the session's own
  int frames;
  float direction_deg;  ///< bound of a lamp's direction seen from where the object stands
  float share;          ///< bound of its irradiance there
  double albedo;        ///< bound of the mean error over what the first frame shows
};

void PrintTo(const Case& c, std::ostream* out) { *out << c.session << " " << c.fisheye; }

class AlbedoSessions : public testing::TestWithParam<Case> {};

std::filesystem::path folder_of(const std::string& session) {
  if (session == "recording") return std::filesystem::path(LUMIGRAFT_SOURCE_DIR) / "recordings/tabletop";
  const char* extra = std::getenv("LUMIGRAFT_EXTRA");
  return extra ? std::filesystem::path(extra) / "sessions" / session : std::filesystem::path();
}

TEST_P(AlbedoSessions, LampsAndAlbedoAreNearTheTruth) {
  const Case& c = GetParam();
  const std::filesystem::path folder = folder_of(c.session);
  if (!std::filesystem::exists(folder / "session.toml")) {
    GTEST_SKIP() << "LUMIGRAFT_EXTRA names no folder with sessions/" << c.session;
  }
  std::vector<std::string> overrides;
  if (*c.fisheye) overrides.push_back(std::string("fisheye.source=images:") + c.fisheye);
  const Session session = read_session(ConfigTable::load(folder / "session.toml", overrides));
  const auto frames = open_frames(session);
  PoseStage locate(session.tag, session.color.model, session.color.response);
  FusionStage fuse(session, {});
  LightStage light(session, {});
  std::optional<Pose> pose, first_pose;
  std::optional<FrameSet> frame, first;
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

  // A point above the tag's far edge, where exhibits of these sessions stand.
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
    const float share = irradiance.sum() / lamp.at(object).sum();
    const float distance = (nearest->position_m - probe).norm() / (lamp.centre - probe).norm();
    const float power = nearest->irradiance.sum() / lamp.at(probe).sum();
    std::printf(
        "    direction %.2f deg off, distance %+.1f %%, irradiance at the probe %+.1f %%; at the object %.2f deg off, "
        "irradiance %+.1f %%%s\n",
        angle_deg(nearest->direction, lamp.centre - probe), 100 * (distance - 1), 100 * (power - 1), at_object_deg,
        100 * (share - 1), nearest->clipped ? "   (clipped)" : "");
    EXPECT_NEAR(distance, 1, nearest->clipped ? 0.25f : 0.2f);
    EXPECT_EQ(nearest->flat, lamp.normal.has_value());
    EXPECT_LT(at_object_deg, c.direction_deg);
    EXPECT_NEAR(share, 1, c.share);
  }
  const auto [error, unknown] =
      albedo_error(*result.albedo, read_radiance(folder / "truth/000000/albedo.exr"), *first, session, *first_pose);
  std::printf("    albedo: mean error %.4f, %.1f %% unknown\n", error, 100 * unknown);
  EXPECT_LT(error, c.albedo);
  EXPECT_LT(unknown, 0.03);
}

constexpr const char* kClipped = "fisheye-ldr.txt";
INSTANTIATE_TEST_SUITE_P(
    All, AlbedoSessions,
    testing::Values(Case{"tabletop", "", 1, 1.5f, 0.08f, 0.06}, Case{"tabletop", kClipped, 1, 2.0f, 0.25f, 0.07},
                    Case{"cornell", "", 1, 1.0f, 0.06f, 0.04}, Case{"cornell", kClipped, 1, 1.0f, 0.15f, 0.05},
                    Case{"box-with-inside", "", 1, 1.0f, 0.05f, 0.03},
                    Case{"box-with-inside", kClipped, 1, 1.0f, 0.15f, 0.04},
                    Case{"brushed-metal", "", 1, 3.5f, 0.08f, 0.03},
                    Case{"brushed-metal", kClipped, 1, 6.0f, 0.45f, 0.03},
                    Case{"tabletop-orbit", "", 12, 2.5f, 0.3f, 0.08}, Case{"recording", "", 12, 2.0f, 0.1f, 0.06}));

}  // namespace
}  // namespace lumigraft
