#include "tests/reconstruct/room/mirror_wall.h"

#include <gtest/gtest.h>

#include "reconstruct/albedo/albedo.h"
#include "tests/reconstruct/albedo/albedo_room.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Vector3d;

struct KnownAlbedo {
  int wall = 0, table = 0;  ///< voxels
};

KnownAlbedo known(const AlbedoField& albedo) {
  KnownAlbedo result;
  for (const auto& [key, brick] : albedo.bricks)
    for (int i = 0; i < kBrickVoxels; ++i) {
      if (brick->sigma[static_cast<std::size_t>(i)] < 0) continue;
      const Eigen::Vector3f p = albedo.voxel_m * voxel_in(key, i).cast<float>();
      if (p.z() > 0.1f && p.y() > test::kWall_m - 0.02)
        ++result.wall;
      else if (p.y() < test::kWall_m - 0.1)
        ++result.table;
    }
  return result;
}

TEST(MirrorWall, HasNoAlbedo) {
  TestRoom lit;
  lit.ambient = Eigen::Vector3f::Ones();
  const Illumination light = lit.illumination();
  const auto solved = [&](const test::Look& look) {
    return AlbedoStage{capture::Session()}.solve_complete(*test::fused(look, {-90}), light);
  };
  const auto mirror = solved(test::mirror_of(0.8, Vector3d::Zero()));
  EXPECT_EQ(mirror.mirrors.size(), 1u);
  EXPECT_EQ(known(*mirror.albedo).wall, 0);
  EXPECT_GT(known(*mirror.albedo).table, 1000);
  const auto painted = solved([](const Vector3d& p, const Vector3d&) -> Vector3d {
    return test::on_wall(p) ? Vector3d(0.2, 0.2, 0.2) : test::tiled_table(p);
  });
  EXPECT_TRUE(painted.mirrors.empty());
  EXPECT_GT(known(*painted.albedo).wall, 1000);
}

}  // namespace
}  // namespace lumigraft::reconstruct
