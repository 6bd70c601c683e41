#include "reconstruct/fusion/real_surface.h"

#include <gtest/gtest.h>

#include "reconstruct/field/real_surface_mesh.h"
#include "reconstruct/fusion/fusion.h"
#include "tests/reconstruct/fusion/fusion_views.h"
#include "tests/reconstruct/fusion/real_surface_views.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;
using Eigen::Vector3f;
using namespace test;

const Vector3d kMiddle(0, 0.1, 0.1), kHalf(0.12, 0.08, 0.1);
double crate(const Vector3d& p) { return test::box(p, kMiddle, kHalf); }
double crate_on_table(const Vector3d& p) { return std::min(table(p), crate(p)); }

Isometry3d moved_by(const Vector3d& shift_m, double turn_rad) {
  Isometry3d T = Isometry3d::Identity();
  T.linear() = Eigen::AngleAxisd(turn_rad, Vector3d(0.3, 0.2, 1).normalized()).toRotationMatrix();
  T.translation() = shift_m;
  return T;
}

std::shared_ptr<const DistanceField> fused(FusionStage& stage, const capture::CameraModel& camera,
                                           unsigned pictures = 10) {
  const Isometry3d T = looking_at_tag(0.9, 50 * kDegree, -1.3, {0, 0.1, 0.1});
  std::shared_ptr<const DistanceField> field;
  for (unsigned i = 0; i < pictures; ++i)
    field = stage.fuse(frame_of(crate_on_table, camera, T, i, {0.5, i + 1}), pose_at(T));
  return field;
}

TEST(RealSurface, AMeshBecomesItsDistances) {
  const DistanceField field = field_of(read_triangles(real_surface("box", box_faces(kMiddle, kHalf))), 0.008f, 0.032f);
  int known = 0;
  double off = 0;
  for (double x = -0.16; x < 0.16; x += 0.0113)
    for (double y = -0.02; y < 0.22; y += 0.0113)
      for (double z = -0.04; z < 0.24; z += 0.0113) {
        const Vector3d p(x, y, z);
        const auto sample = field.sample(p.cast<float>());
        if (!sample) continue;
        ++known;
        off += std::abs(sample->distance_m - crate(p));
        EXPECT_NEAR(sample->distance_m, crate(p), 4e-3) << p.transpose();
      }
  EXPECT_GT(known, 1500);
  EXPECT_LT(off / known, 5e-4) << "edges are rounded by less than half a voxel";
  EXPECT_FALSE(field.sample(kMiddle.cast<float>())) << "far inside it is unknown";
}

// The pose in the session has an error of a centimetre: depth corrects it, and the model fills what depth does not see.
TEST(RealSurface, IsFoundInDepthAndMerged) {
  const capture::CameraModel camera = small_camera();
  const Isometry3d wrong = moved_by({0.008, -0.005, 0.004}, 1 * kDegree);
  capture::Session session = session_with(camera);
  session.real_surfaces = {real_surface("crate", box_faces(kMiddle, kHalf, wrong))};
  FusionStage with(session, {}), without(session_with(camera), {});
  const auto field = fused(with, camera), plain = fused(without, camera);
  const auto back = [&](const DistanceField& of) {  // number of solid points behind the side that no image shows
    int solid = 0;
    for (float x = -0.09f; x < 0.1f; x += 0.03f)
      for (float z = 0.03f; z < 0.13f; z += 0.03f) {
        const auto sample = of.sample(Vector3f(x, 0.172f, z));
        solid += sample && std::abs(sample->distance_m + 0.008f) < 3e-3f;
      }
    return solid;
  };
  EXPECT_EQ(back(*plain), 0);
  EXPECT_EQ(back(*field), 28);
  const Isometry3d T = looking_at_tag(0.9, 50 * kDegree, -1.3, {0, 0.1, 0.1});
  const Agreement seen = compare(*field, crate_on_table, camera, T, 16),
                  seen_plain = compare(*plain, crate_on_table, camera, T, 16);
  EXPECT_LT(seen.mean_m, 1.1 * seen_plain.mean_m);
  EXPECT_GT(seen.hit_fraction, 0.98);
  ASSERT_EQ(with.warnings().size(), 1u);
  EXPECT_NE(with.warnings()[0].find("\"crate\" is"), std::string::npos) << with.warnings()[0];
}

TEST(RealSurface, OffsetIsReported) {
  const capture::CameraModel camera = small_camera();
  const Isometry3d T = looking_at_tag(0.9, 50 * kDegree, -1.3, {0, 0.1, 0.1});
  const Isometry3d wrong = moved_by({0.008, -0.005, 0.004}, 1 * kDegree);
  capture::Session session = session_with(camera);
  session.real_surfaces = {real_surface("crate", box_faces(kMiddle, kHalf, wrong))};
  RealSurfaces surfaces(session, 0.008f);
  EXPECT_TRUE(surfaces.bricks().empty()) << "before any frame";
  for (unsigned i = 0; i < 8; ++i)
    surfaces.register_models(frame_of(crate_on_table, camera, T, i, {0.5, i + 1}).depth->depth_m, T);
  const RealSurfaces::Found& found = surfaces.found()[0];
  ASSERT_EQ(found.state, RealSurfaces::State::used);
  const Isometry3d left = found.T_tag_model * wrong;
  EXPECT_LT((left * kMiddle - kMiddle).norm(), 2e-3);
  EXPECT_LT(Eigen::AngleAxisd(left.linear()).angle(), 0.4 * kDegree);
  EXPECT_FALSE(surfaces.bricks().empty());
}

TEST(RealSurface, RejectedIfDepthContradictsIt) {
  const capture::CameraModel camera = small_camera();
  capture::Session session = session_with(camera);
  session.real_surfaces = {real_surface("shelf", box_faces({0, 0.1, 0.4}, {0.2, 0.1, 0.01}))};
  FusionStage with(session, {}), without(session_with(camera), {});
  const auto field = fused(with, camera, 3), plain = fused(without, camera, 3);
  ASSERT_EQ(with.warnings().size(), 1u);
  EXPECT_NE(with.warnings()[0].find("is not used"), std::string::npos) << with.warnings()[0];
  ASSERT_EQ(field->bricks.size(), plain->bricks.size());
  for (const auto& [key, brick] : field->bricks) EXPECT_EQ(brick->distance_m, plain->brick(key)->distance_m);
}

// Objects on a real surface are kept.
TEST(RealSurface, KeepsObjectsOnIt) {
  const capture::CameraModel camera = small_camera();
  capture::Session session = session_with(camera);
  session.real_surfaces = {real_surface("table", box_faces({0, 0, -0.02}, {0.5, 0.5, 0.02}))};
  FusionStage with(session, {});
  const auto field = fused(with, camera);
  EXPECT_TRUE(with.warnings().empty());
  const Isometry3d T = looking_at_tag(0.9, 50 * kDegree, -1.3, {0, 0.1, 0.1});
  const Agreement seen = compare(*field, crate_on_table, camera, T, 16);
  EXPECT_LT(seen.mean_m, 1e-3);
  EXPECT_GT(seen.hit_fraction, 0.98);
  // The crate's front, down to where the table's distances are merged.
  for (float x = -0.08f; x < 0.09f; x += 0.04f) {
    const auto hit = field->raycast({x, -0.1f, 0.012f}, Vector3f::UnitY(), 0, 0.3f);
    ASSERT_TRUE(hit) << x;
    EXPECT_NEAR(hit->position_m.y(), kMiddle.y() - kHalf.y(), 5e-3) << x;
  }
}

}  // namespace
}  // namespace lumigraft::reconstruct
