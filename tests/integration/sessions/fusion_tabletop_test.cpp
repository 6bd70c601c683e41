// Real depth pictures of objects on tables, labelled by hand, compared with the surface fused from one picture.
// LUMIGRAFT_EXTRA names a folder that contains data/tabletop-clouds.
#include <gtest/gtest.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cstdio>
#include <map>

#include "reconstruct/fusion/fusion.h"
#include "reconstruct/room/mirror_detection.h"
#include "tests/integration/sessions/recorded_session.h"
#include "tests/reconstruct/point_cloud.h"
#include "tests/reconstruct/real_data.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Vector3f;
using test::percentile;

capture::CameraModel kinect() {
  capture::CameraModel camera;
  camera.width = 640;
  camera.height = 480;
  camera.fx = camera.fy = 525;
  camera.cx = 319.5;
  camera.cy = 239.5;
  return camera;
}

struct Plane {
  Vector3f normal = Vector3f::UnitZ();
  float offset = 0;
  float distance(const Vector3f& p) const { return normal.dot(p) - offset; }
};

Plane fitted(const std::vector<Vector3f>& points) {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (const Vector3f& p : points) mean += p.cast<double>() / static_cast<double>(points.size());
  Eigen::Matrix3d spread = Eigen::Matrix3d::Zero();
  for (const Vector3f& p : points) {
    const Eigen::Vector3d d = p.cast<double>() - mean;
    spread += d * d.transpose();
  }
  Plane plane;
  plane.normal = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(spread).eigenvectors().col(0).cast<float>();
  if (plane.normal.dot(mean.cast<float>()) > 0) plane.normal *= -1;  // towards the camera
  plane.offset = plane.normal.dot(mean.cast<float>());
  return plane;
}

/// Whether all pixels within `reach` were measured; next to unmeasured pixels the surface ends.
bool all_measured_around(const test::PointCloud& cloud, std::size_t pixel, int reach) {
  const int u = static_cast<int>(pixel) % cloud.width, v = static_cast<int>(pixel) / cloud.width;
  for (int y = v - reach; y <= v + reach; ++y)
    for (int x = u - reach; x <= u + reach; ++x) {
      if (x < 0 || y < 0 || x >= cloud.width || y >= cloud.height) return false;
      if (cloud.points[static_cast<std::size_t>(y) * cloud.width + x].z() <= 0) return false;
    }
  return true;
}

TEST(FusionTabletop, TablesAreFlatAndThingsAreThere) {
  const auto folder = test::data_folder("tabletop-clouds");
  if (!folder) GTEST_SKIP() << "LUMIGRAFT_EXTRA names no folder with data/tabletop-clouds";
  for (const char* name : {"test0", "test20"}) {
    const test::PointCloud cloud = test::read_cloud(*folder / (std::string(name) + ".pcd"));
    capture::Session session;
    session.color.model = kinect();
    capture::FrameSet frame;
    auto depth = std::make_shared<capture::DepthFrame>();
    depth->depth_m = capture::Image<float>(640, 480, 1);
    for (std::size_t i = 0; i < cloud.points.size(); ++i) depth->depth_m.data[i] = cloud.points[i].z();
    frame.depth = depth;
    auto color = std::make_shared<capture::Frame>();
    color->encoded = capture::Image<std::uint8_t>(640, 480, 3, 128);
    frame.color = color;
    FusionStage fusion(session, {});
    const auto field = fusion.fuse(frame, {});
    ASSERT_TRUE(field);
    const std::vector<RoomPoint> points = room_points(*field);
    const auto reflecting = find_reflecting_planes(points, *field, MetalMask(session));
    EXPECT_TRUE(mirror_warnings(points, *field, reflecting).empty()) << name;

    std::map<unsigned, std::vector<std::size_t>> pixels;  // by object; 1 is the table
    std::vector<Vector3f> table;
    for (std::size_t i = 0; i < cloud.points.size(); ++i) {
      if (cloud.points[i].z() <= 0 || cloud.labels[i] == 0) continue;
      const unsigned object = cloud.labels[i] < 10 ? 1 : cloud.labels[i] / 10;
      pixels[object].push_back(i);
      if (object == 1) table.push_back(cloud.points[i]);
    }
    const Plane plane = fitted(table);
    for (const auto& [object, of] : pixels) {
      std::vector<double> off_mm, off_plane_mm, turned;
      int inner = 0, met = 0;
      for (const std::size_t i : of) {
        const bool counts = all_measured_around(cloud, i, 5);
        inner += counts;
        const auto hit = field->raycast(Vector3f::Zero(), cloud.points[i].normalized(), 0.3f, 4);
        if (!hit) continue;
        met += counts;
        off_mm.push_back(1e3 * std::abs(hit->distance_m - cloud.points[i].norm()));
        off_plane_mm.push_back(1e3 * std::abs(plane.distance(hit->position_m)));
        turned.push_back(std::acos(std::clamp(hit->normal.dot(plane.normal), -1.0f, 1.0f)) * 57.2958);
      }
      std::printf("fusion: %s %-8s %6zu pixels, %.1f %% of the inner ones met, %.1f mm off, 95 %% below %.1f\n", name,
                  object == 1 ? "table" : "thing", of.size(), 100.0 * met / inner, percentile(off_mm, 0.5),
                  percentile(off_mm, 0.95));
      EXPECT_GT(met, 0.97 * inner) << name << " " << object;
      EXPECT_LT(percentile(off_mm, 0.5), 1) << name << " " << object;
      EXPECT_LT(percentile(off_mm, 0.95), 4.5) << name << " " << object;
      if (object != 1) continue;
      std::vector<double> points_mm;
      for (const Vector3f& p : table) points_mm.push_back(1e3 * std::abs(plane.distance(p)));
      std::printf("    flat to %.1f mm, 95 %% %.1f (its points %.1f, %.1f); normals %.1f deg off, 95 %% %.1f\n",
                  percentile(off_plane_mm, 0.5), percentile(off_plane_mm, 0.95), percentile(points_mm, 0.5),
                  percentile(points_mm, 0.95), percentile(turned, 0.5), percentile(turned, 0.95));
      EXPECT_LT(percentile(off_plane_mm, 0.95), percentile(points_mm, 0.95));
      EXPECT_LT(percentile(turned, 0.5), 5);
    }
  }
}

}  // namespace
}  // namespace lumigraft::reconstruct
