#include "reconstruct/room/mirror_detection.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <filesystem>

#include "capture/source.h"
#include "reconstruct/fusion/fusion.h"
#include "reconstruct/pose/pose.h"
#include "tests/reconstruct/fusion/fusion_views.h"
#include "tests/reconstruct/fusion/real_surface_views.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;
using test::Shape;

constexpr double kWall = 0.5, kHeight = 0.25;  ///< y of a wall with a hole in it, z of the hole's middle

double room(const Vector3d& p) { return test::ball_on_table(p); }

/// A wall behind the table with a square hole of edge `edge`, through which `behind` is visible.
Shape with_hole(double edge, const Shape& behind) {
  return [edge, behind](const Vector3d& p) {
    const double hole = std::max(std::abs(p.x()), std::abs(p.z() - kHeight)) - 0.5 * edge;
    const double wall = std::max(std::max(kWall - p.y(), p.y() - kWall - 0.01), -hole);
    return std::min({std::max(room(p), p.y() - kWall), wall, std::max(behind(p), kWall - p.y())});
  };
}

Vector3d reflected(const Vector3d& p) { return {p.x(), 2 * kWall - p.y(), p.z()}; }
double mirrored(const Vector3d& p) { return room(reflected(p)); }
/// A neighbouring room: a table at the same height with another object.
double next_door(const Vector3d& p) {
  return std::min({p.z(), test::box(p, {0.05, kWall + 0.5, 0.1}, {0.1, 0.1, 0.1}), kWall + 1 - p.y()});
}

std::vector<DetectedMirror> found(const Shape& shape, const std::vector<double>& azimuths,
                                  const std::vector<capture::RealSurface>& named = {}) {
  const capture::CameraModel camera = test::small_camera();
  capture::Session session = test::session_with(camera);
  session.real_surfaces = named;
  FusionStage stage(session, {});
  std::shared_ptr<const DistanceField> field;
  unsigned i = 0;
  for (const double azimuth : azimuths) {
    for (int again = 0; again < 3; ++again, ++i) {
      const Isometry3d T = test::looking_at_tag(1.1, 65 * test::kDegree, azimuth * test::kDegree, {0, 0.3, kHeight});
      field = stage.fuse(test::frame_of(shape, camera, T, i, {0.5, i + 1}), test::pose_at(T));
    }
  }
  return find_mirrors(room_points(*field), *field);
}

const std::vector<double> kOneView = {-90}, kManyViews = {-140, -115, -90, -65, -40};

TEST(MirrorDetection, AMirrorInAWall) {
  for (const auto& [edge, views] : {std::pair{0.3, kManyViews}, std::pair{0.4, kManyViews}, std::pair{0.4, kOneView}}) {
    const auto mirrors = found(with_hole(edge, mirrored), views);
    ASSERT_EQ(mirrors.size(), 1u) << edge << " " << views.size();
    EXPECT_LT((mirrors[0].normal + Eigen::Vector3f::UnitY()).norm(), 0.02f);
    EXPECT_NEAR(mirrors[0].middle_m.y(), kWall, 0.01);
    EXPECT_LT(std::hypot(mirrors[0].middle_m.x(), mirrors[0].middle_m.z() - kHeight), edge);
    std::printf("mirror of %.1f m, %zu views: %d points confirm it, %d contradict it\n", edge, views.size(),
                mirrors[0].confirmed, mirrors[0].contradicted);
  }
}

TEST(MirrorDetection, ConfiguredMirrorIsNotReported) {
  auto mirror = test::real_surface("mirror", test::box_faces({0, kWall + 0.01, kHeight}, {0.2, 0.01, 0.2}));
  mirror.metallic = 1;
  mirror.roughness = 0.02f;
  EXPECT_TRUE(found(with_hole(0.4, mirrored), kManyViews, {mirror}).empty());
}

TEST(MirrorDetection, OpeningToAnotherRoomIsNoMirror) {
  EXPECT_TRUE(found(with_hole(0.4, next_door), kManyViews).empty());
}

TEST(MirrorDetection, NoHoleNoMirror) { EXPECT_TRUE(found(room, kManyViews).empty()); }

// Rooms without a mirror, or with a mirror that the depth camera measures.
TEST(MirrorDetection, NoneInRecordedRooms) {
  const char* extra = std::getenv("LUMIGRAFT_EXTRA");
  std::vector<std::filesystem::path> folders = {std::filesystem::path(LUMIGRAFT_SOURCE_DIR) / "recordings/tabletop"};
  for (const char* name : {"tabletop", "cornell", "box-with-inside", "brushed-metal", "tabletop-orbit"}) {
    const auto folder = std::filesystem::path(extra ? extra : "") / "sessions" / name;
    if (extra && std::filesystem::exists(folder / "session.toml")) folders.push_back(folder);
  }
  for (const auto& folder : folders) {
    const capture::Session session = capture::read_session(capture::ConfigTable::load(folder / "session.toml"));
    const auto frames = capture::open_frames(session);
    PoseStage locate(session.tag, session.color.model, session.color.response);
    FusionStage fuse(session, {});
    std::shared_ptr<const DistanceField> field;
    for (int i = 0; i < 8; ++i) {
      const auto frame = frames->next(std::chrono::seconds(1));
      ASSERT_TRUE(frame);
      const auto pose = locate.locate(*frame).pose;
      ASSERT_TRUE(pose);
      field = fuse.fuse(*frame, *pose);
    }
    const std::clock_t start = std::clock();
    const std::vector<RoomPoint> points = room_points(*field);
    const auto warnings = mirror_warnings(points, *field, find_reflecting_planes(points, *field, MetalMask(session)));
    std::printf("mirrors: %s, %.1f CPU ms\n", folder.filename().c_str(),
                1e3 * static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC);
    EXPECT_TRUE(warnings.empty()) << folder << ": " << warnings.front();
  }
}

}  // namespace
}  // namespace lumigraft::reconstruct
