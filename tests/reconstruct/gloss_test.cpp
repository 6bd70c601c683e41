#include "reconstruct/gloss.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <filesystem>

#include "capture/picture_file.h"
#include "capture/source.h"
#include "reconstruct/albedo.h"
#include "reconstruct/fusion.h"
#include "reconstruct/light.h"
#include "tests/reconstruct/fusion_views.h"

namespace lumigraft {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;

const Vector3d kLamp(0.2, 0.6, 1.2);
constexpr double kRadius = 0.04, kIntensity = 0.3;  // m; W/sr
constexpr double kAlbedo = 0.4, kSky = 0.02;

/// GGX with Schlick's Fresnel and Smith's shadowing (Walter et al. 2007, eq. 20, 33, 34), times π over the incident
/// irradiance: how much brighter than a white diffuse surface.
double lobe(const Vector3d& n, const Vector3d& l, const Vector3d& v, double alpha, double f0) {
  const Vector3d h = (l + v).normalized();
  const double nh = n.dot(h), a2 = alpha * alpha;
  const double d = a2 / (M_PI * std::pow(nh * nh * (a2 - 1) + 1, 2));
  const auto g1 = [&](double c) { return 2 * c / (c + std::sqrt(a2 + (1 - a2) * c * c)); };
  const double fresnel = f0 + (1 - f0) * std::pow(1 - h.dot(v), 5);
  return M_PI * fresnel * d * g1(n.dot(l)) * g1(n.dot(v)) / (4 * n.dot(l) * n.dot(v));
}

/// A table, radiance of a place seen from a camera; alpha 0 is nothing but diffuse. A lamp of some size widens the
/// lobe.
double radiance(const Vector3d& p, const Vector3d& camera, double alpha, double f0) {
  const Vector3d n = Vector3d::UnitZ(), way = kLamp - p, l = way.normalized(), v = (camera - p).normalized();
  const double irradiance = kIntensity * l.z() / way.squaredNorm();
  double light = kAlbedo * (irradiance + kSky) / M_PI;
  const double widened = std::hypot(alpha, 0.5 * kRadius / way.norm());
  if (alpha > 0) light += irradiance / M_PI * lobe(n, l, v, widened, f0);
  return light;
}

struct Known {
  int matt = 0, glossy = 0, mirror = 0, unknown = 0;
};

Illumination lamp_light() {
  Illumination light;
  light.remainder_sh.fill(Eigen::Vector3f::Zero());
  PointLight lamp;
  lamp.distance_known = true;
  lamp.position_m = kLamp.cast<float>();
  lamp.direction = kLamp.normalized().cast<float>();
  lamp.radius_m = kRadius;
  lamp.intensity.setConstant(kIntensity);
  lamp.irradiance.setConstant(static_cast<float>(kIntensity / kLamp.squaredNorm()));
  light.lights = {lamp};
  return light;
}

/// What is told of the table, by cells, after a camera went over it, with noise in depth.
Known seen(double alpha, double f0) {
  const CameraModel camera = test::small_camera();
  FusionStage fusion(test::session_with(camera), {});
  GlossStage stage(test::session_with(camera));
  const Illumination light = lamp_light();
  std::shared_ptr<const GlossField> gloss;
  for (unsigned i = 0; i < 28; ++i) {
    const Isometry3d T = test::looking_at_tag(1.0, 40 * test::kDegree, (-130 + 3.0 * i) * test::kDegree);
    const auto frame = test::frame_of(test::table, camera, T, i, {0.3, i + 1},
                                      [&](const Vector3d& p) { return radiance(p, T.translation(), alpha, f0); });
    gloss = stage.look(frame, test::pose_at(T), *fusion.fuse(frame, test::pose_at(T)), light, nullptr);
  }
  Known known;
  for (double x = -0.25; x <= 0.25; x += gloss->cell_m)
    for (double y = -0.25; y <= 0.25; y += gloss->cell_m) {
      Gloss told = Gloss::unknown;  // the table's plane is a border of cells
      for (const double z : {0.001, -0.001})
        if (told == Gloss::unknown) told = gloss->at(Vector3d(x, y, z).cast<float>());
      ++(told == Gloss::matt     ? known.matt
         : told == Gloss::glossy ? known.glossy
         : told == Gloss::mirror ? known.mirror
                                 : known.unknown);
    }
  return known;
}

TEST(GlossStage, ClassesOfATable) {
  struct Case {
    double alpha, f0;
    Gloss gloss;
  };
  for (const Case& c :
       {Case{0, 0, Gloss::matt}, Case{0.6, 0.04, Gloss::matt}, Case{0.14, 0.04, Gloss::glossy},
        Case{0.3, 0.9, Gloss::glossy}, Case{0.05, 0.04, Gloss::mirror}, Case{0.01, 0.9, Gloss::mirror}}) {
    const Known known = seen(c.alpha, c.f0);
    std::printf("gloss: alpha %.2f, f0 %.2f: %d matt, %d glossy, %d mirror, %d unknown\n", c.alpha, c.f0, known.matt,
                known.glossy, known.mirror, known.unknown);
    const int told = known.matt + known.glossy + known.mirror;
    EXPECT_GE(told, 5) << c.alpha;
    EXPECT_LT(told, 0.2 * known.unknown) << c.alpha << ": most of it no view showed in a lamp's reflection";
    const int right = c.gloss == Gloss::matt ? known.matt : c.gloss == Gloss::glossy ? known.glossy : known.mirror;
    EXPECT_GE(right, 0.6 * told) << c.alpha;
    if (c.gloss == Gloss::matt) {
      EXPECT_EQ(known.glossy + known.mirror, 0) << c.alpha;
    } else {
      EXPECT_EQ(known.matt, 0) << c.alpha;
    }
  }
}

TEST(GlossStage, WithoutALampsPlaceNothingIsTold) {
  const CameraModel camera = test::small_camera();
  FusionStage fusion(test::session_with(camera), {});
  GlossStage stage(test::session_with(camera));
  Illumination light = lamp_light();
  light.lights[0].distance_known = false;
  for (unsigned i = 0; i < 8; ++i) {
    const Isometry3d T = test::looking_at_tag(1.0, 40 * test::kDegree, (-100 + 3.0 * i) * test::kDegree);
    const auto frame = test::frame_of(test::table, camera, T, i);
    EXPECT_FALSE(stage.look(frame, test::pose_at(T), *fusion.fuse(frame, test::pose_at(T)), light, nullptr));
  }
}

// Rooms that a camera went through; their truth has the reflectance at normal incidence of every pixel of the first
// picture. Everything in them is matt.
TEST(GlossStage, RoomsWithTruth) {
  const char* extra = std::getenv("LUMIGRAFT_EXTRA");
  std::vector<std::filesystem::path> folders = {std::filesystem::path(LUMIGRAFT_SOURCE_DIR) / "recordings/tabletop"};
  const auto orbit = std::filesystem::path(extra ? extra : "") / "sessions/tabletop-orbit";
  if (extra && std::filesystem::exists(orbit / "session.toml")) folders.push_back(orbit);
  for (const auto& folder : folders) {
    const Session session = read_session(ConfigTable::load(folder / "session.toml"));
    const auto frames = open_frames(session);
    PoseStage locate(session.tag, session.color.model, session.color.response);
    FusionStage fuse(session, {});
    LightStage light(session, {});
    AlbedoStage albedo(session);
    GlossStage stage(session);
    AlbedoStage::Result solution;
    std::shared_ptr<const GlossField> gloss;
    std::optional<FrameSet> first;
    std::optional<Pose> first_pose;
    double ms = 0;
    int pictures = 0;
    while (const auto frame = frames->next(std::chrono::seconds(1))) {
      if (pictures == 24) break;
      const auto pose = locate.locate(*frame).pose;
      ASSERT_TRUE(pose);
      const auto field = fuse.fuse(*frame, *pose);
      const auto lamps = light.extract(*frame).illumination;
      if (!first) {
        first = *frame;
        first_pose = pose;
        solution = albedo.solve(*field, *lamps);
      }
      const std::clock_t start = std::clock();
      gloss = stage.look(*frame, *pose, *field, *solution.illumination, solution.albedo.get());
      ms += 1e3 * static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
      ++pictures;
    }
    ASSERT_TRUE(gloss);
    const auto f0 = read_radiance(folder / "truth/000000/f0.exr");
    int right = 0, wrong = 0, unknown = 0;
    for (int v = 0; v < f0.height; ++v) {
      for (int u = 0; u < f0.width; ++u) {
        const float depth_m = first->depth->depth_m.at(u, v);
        const auto ray = session.color.model.unproject(Eigen::Vector2d(u, v));
        if (depth_m <= 0 || !ray) continue;
        const Vector3d place = first_pose->T_tag_camera * (*ray * (depth_m / ray->z()));
        const Gloss told = gloss->at(place.cast<float>());
        const bool matt = f0.at(u, v, 1) < 0.01f;
        ++(told == Gloss::unknown ? unknown : (told == Gloss::matt) == matt ? right : wrong);
      }
    }
    std::printf(
        "gloss: %s, %.0f %% of what is seen is told, %.1f %% of it wrong; %.0f %% of the surface; %.1f CPU ms a "
        "picture\n",
        folder.filename().c_str(), 100.0 * (right + wrong) / (right + wrong + unknown),
        100.0 * wrong / std::max(1, right + wrong), 100 * gloss->known_share(), ms / pictures);
    EXPECT_GT(right, 0.2 * (right + wrong + unknown));
    EXPECT_LT(wrong, 0.02 * (right + wrong));
  }
}

}  // namespace
}  // namespace lumigraft
