#include "tests/reconstruct/room/mirror_wall.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "reconstruct/albedo/albedo.h"
#include "tests/reconstruct/albedo/albedo_room.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Vector3d;

struct LargestAlbedo {
  float wall = -1, table = -1;  ///< of voxels where it is known
};

LargestAlbedo largest(const AlbedoField& albedo) {
  LargestAlbedo result;
  for (const auto& [key, brick] : albedo.bricks)
    for (int i = 0; i < kBrickVoxels; ++i) {
      if (brick->sigma[static_cast<std::size_t>(i)] < 0) continue;
      const Eigen::Vector3f p = albedo.voxel_m * voxel_in(key, i).cast<float>();
      const float here = brick->albedo[static_cast<std::size_t>(i)].maxCoeff();
      if (p.z() > 0.1f && p.y() > test::kWall_m - 0.02)
        result.wall = std::max(result.wall, here);
      else if (p.y() < test::kWall_m - 0.1)
        result.table = std::max(result.table, here);
    }
  return result;
}

TEST(MirrorWall, HasNoDiffuseAlbedo) {
  TestRoom lit;
  lit.ambient = Eigen::Vector3f::Ones();
  const Illumination light = lit.illumination();
  const auto solved = [&](const test::Look& look) {
    return AlbedoStage{capture::Session()}.solve_complete(*test::fused(look, {-90}), light);
  };
  const auto mirror = solved(test::mirror_of(0.8, Vector3d::Zero()));
  EXPECT_EQ(mirror.mirrors.size(), 1u);
  EXPECT_EQ(largest(*mirror.albedo).wall, 0);
  EXPECT_GT(largest(*mirror.albedo).table, 0.2f);
  const auto painted = solved([](const Vector3d& p, const Vector3d&) -> Vector3d {
    return test::on_wall(p) ? Vector3d(0.2, 0.2, 0.2) : test::tiled_table(p);
  });
  EXPECT_TRUE(painted.mirrors.empty());
  EXPECT_GT(largest(*painted.albedo).wall, 0.1f);
}

}  // namespace
}  // namespace lumigraft::reconstruct
