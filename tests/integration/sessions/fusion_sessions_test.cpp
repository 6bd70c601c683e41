// Compares the fused surfaces of recorded sessions with their true surfaces.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <limits>

#include "capture/session/session.h"
#include "capture/source.h"
#include "reconstruct/field/surface_mesh.h"
#include "reconstruct/fusion/fusion.h"
#include "reconstruct/pose/pose.h"
#include "tests/integration/sessions/recorded_session.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Vector3f;
using test::folder_of;
using test::percentile;
using Triangle = std::array<Vector3f, 3>;

/// Reads the triangles of real_scene.ply: nine floats per vertex, x y z first.
std::vector<Triangle> true_surface(const std::filesystem::path& path) {
  std::ifstream in(path, std::ios::binary);
  std::string line;
  std::size_t vertex_count = 0, face_count = 0, properties = 0;
  while (std::getline(in, line) && line != "end_header") {
    if (line.starts_with("element vertex ")) vertex_count = std::stoul(line.substr(15));
    if (line.starts_with("element face ")) face_count = std::stoul(line.substr(13));
    properties += line.starts_with("property float ");
  }
  std::vector<float> values(vertex_count * properties);
  in.read(reinterpret_cast<char*>(values.data()), static_cast<std::streamsize>(values.size() * sizeof(float)));
  std::vector<Triangle> triangles;
  for (std::size_t f = 0; f < face_count; ++f) {
    const int corners = in.get();
    std::array<int, 3> index{};
    in.read(reinterpret_cast<char*>(index.data()), sizeof(index));
    if (corners != 3 || !in) break;
    Triangle triangle;
    for (int c = 0; c < 3; ++c) triangle[c] = Eigen::Map<const Vector3f>(&values[index[c] * properties]);
    triangles.push_back(triangle);
  }
  return triangles;
}

float distance_to_segment(const Vector3f& p, const Vector3f& a, const Vector3f& b) {
  const Vector3f along = b - a;
  const float t = std::clamp((p - a).dot(along) / std::max(along.squaredNorm(), 1e-20f), 0.0f, 1.0f);
  return (p - a - t * along).norm();
}

float distance_to_triangle(const Vector3f& p, const Triangle& t) {
  const Vector3f across = (t[1] - t[0]).cross(t[2] - t[0]);
  bool above = true;  // whether p projects into the triangle
  for (int i = 0; i < 3; ++i) above &= (t[(i + 1) % 3] - t[i]).cross(p - t[i]).dot(across) >= 0;
  if (above && across.norm() > 0) return std::abs((p - t[0]).dot(across.normalized()));
  return std::min(
      {distance_to_segment(p, t[0], t[1]), distance_to_segment(p, t[1], t[2]), distance_to_segment(p, t[2], t[0])});
}

struct FusionCase {
  const char* session;
  double median_mm, max_mm;  ///< bounds on the median and the 95th percentile of distances to the true surface
  double near_mm;            ///< bound on the 95th percentile within 1 m of the tag along each axis
  double republished = 0;    ///< bound on the fraction of bricks per frame that a second pass republishes; 0 = one pass
};

void PrintTo(const FusionCase& c, std::ostream* out) { *out << c.session; }

class FusionSessions : public testing::TestWithParam<FusionCase> {};

TEST_P(FusionSessions, AreNearTheTruth) {
  const FusionCase& c = GetParam();
  const std::filesystem::path folder = folder_of(c.session);
  if (!std::filesystem::exists(folder / "session.toml"))
    GTEST_SKIP() << "LUMIGRAFT_EXTRA names no folder with sessions/" << c.session;
  const capture::Session session = capture::read_session(capture::ConfigTable::load(folder / "session.toml"));
  PoseStage pose_stage(session.tag, session.color.model, session.color.response);
  FusionStage fusion(session, {});
  std::shared_ptr<const DistanceField> field;
  capture::FrameSet last;
  Pose last_pose;
  for (int round = 0; round < (c.republished > 0 ? 2 : 1); ++round) {
    const auto frames = capture::open_frames(session);
    double cpu_ms = 0;
    int pictures = 0;
    std::size_t changed = 0;
    while (auto frame = frames->next(std::chrono::seconds(1))) {
      const auto located = pose_stage.locate(*frame);
      ASSERT_TRUE(located.pose);
      const auto before = field;
      const std::clock_t start = std::clock();
      field = fusion.fuse(*frame, *located.pose);
      cpu_ms += 1e3 * static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
      ASSERT_TRUE(field);
      for (const auto& [key, brick] : field->bricks) {
        const FieldBrick* old = before ? before->brick(key) : nullptr;
        changed += old != brick.get();
      }
      ++pictures;
      last = std::move(*frame);
      last_pose = *located.pose;
    }
    const double fraction = static_cast<double>(changed) / pictures / static_cast<double>(field->bricks.size());
    std::printf("fusion: %-16s round %d: %.1f CPU ms a picture, %zu bricks, %.2f %% published a picture\n", c.session,
                round + 1, cpu_ms / pictures, field->bricks.size(), 100 * fraction);
    if (round > 0) {
      EXPECT_LT(fraction, c.republished);
    }
  }

  const SurfaceMesh mesh = extract_surface(*field);
  const auto truth = true_surface(folder / "truth/real_scene.ply");
  ASSERT_FALSE(truth.empty());
  std::vector<double> away_mm, near_mm;
  for (std::size_t i = 0; i < mesh.vertices_m.size(); i += mesh.vertices_m.size() / 4000 + 1) {
    float nearest = std::numeric_limits<float>::max();
    for (const Triangle& triangle : truth)
      nearest = std::min(nearest, distance_to_triangle(mesh.vertices_m[i], triangle));
    away_mm.push_back(1e3 * static_cast<double>(nearest));
    if (mesh.vertices_m[i].cwiseAbs().maxCoeff() < 1) near_mm.push_back(away_mm.back());
  }

  // The surface in the last frame's view is complete.
  int rays = 0, met = 0;
  const capture::Image<float>& depth = last.depth->depth_m;
  for (int v = 2; v < depth.height; v += 4)
    for (int u = 2; u < depth.width; u += 4) {
      const auto ray = session.color.model.unproject({static_cast<double>(u), static_cast<double>(v)});
      if (!ray || depth.at(u, v) <= 0 || depth.at(u, v) > 4.5f) continue;
      ++rays;
      const auto hit = field->raycast(last_pose.T_tag_camera.translation().cast<float>(),
                                      (last_pose.T_tag_camera.linear() * *ray).cast<float>(), 0.1f, 6);
      met += hit.has_value();
    }
  std::printf(
      "    %zu triangles, to the truth median / 95 %%: %.2f / %.2f mm; in a cube of 2 m %.2f / %.2f mm; %.1f %% of "
      "rays "
      "met\n",
      mesh.triangles.size(), percentile(away_mm, 0.5), percentile(away_mm, 0.95), percentile(near_mm, 0.5),
      percentile(near_mm, 0.95), 100.0 * met / rays);
  EXPECT_LT(percentile(away_mm, 0.5), c.median_mm);
  EXPECT_LT(percentile(away_mm, 0.95), c.max_mm);
  EXPECT_LT(percentile(near_mm, 0.95), c.near_mm);
  EXPECT_GT(met, 0.98 * rays);
}

INSTANTIATE_TEST_SUITE_P(All, FusionSessions,
                         testing::Values(FusionCase{"recording", 2, 8, 4, 0.03},
                                         FusionCase{"box-with-inside", 0.5, 2, 2},
                                         FusionCase{"brushed-metal", 0.5, 2, 2}, FusionCase{"cornell", 0.5, 2, 2},
                                         FusionCase{"tabletop", 0.5, 2, 2},
                                         FusionCase{"tabletop-orbit", 2, 12, 4, 0.03}),
                         [](const auto& session) {
                           std::string name = session.param.session;
                           std::replace(name.begin(), name.end(), '-', '_');
                           return name;
                         });

}  // namespace
}  // namespace lumigraft::reconstruct
