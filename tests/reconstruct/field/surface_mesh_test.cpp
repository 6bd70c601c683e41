#include "reconstruct/field/surface_mesh.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <Eigen/Geometry>
#include <cmath>
#include <fstream>
#include <functional>
#include <map>

#include "capture/error.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Vector3f;

DistanceField field_of(const std::function<float(const Vector3f&)>& distance_m, int reach_bricks, float band_m) {
  DistanceField field;
  for (int a = -reach_bricks; a < reach_bricks; ++a)
    for (int b = -reach_bricks; b < reach_bricks; ++b)
      for (int c = -reach_bricks; c < reach_bricks; ++c) {
        auto brick = std::make_shared<FieldBrick>();
        bool used = false;
        for (int i = 0; i < kBrickVoxels; ++i) {
          const float d = distance_m(field.voxel_m * Vector3f(8 * a + i % 8, 8 * b + i / 8 % 8, 8 * c + i / 64));
          if (std::abs(d) > band_m) continue;
          brick->distance_m[i] = d;
          brick->weight[i] = 1;
          used = true;
        }
        if (used) field.bricks[{a, b, c}] = brick;
      }
  return field;
}

constexpr float kRadius = 0.1f;
const Vector3f kCentre(0.013f, -0.007f, 0.004f);
float small_sphere(const Vector3f& p) { return (p - kCentre).norm() - kRadius; }

/// Number of uses of each directed edge: a closed surface uses every edge once in each direction.
std::map<std::pair<int, int>, int> edges_of(const SurfaceMesh& mesh) {
  std::map<std::pair<int, int>, int> edges;
  for (const auto& t : mesh.triangles)
    for (int i = 0; i < 3; ++i) ++edges[{t[i], t[(i + 1) % 3]}];
  return edges;
}

TEST(SurfaceMesh, ASphereIsClosedAndRound) {
  const SurfaceMesh mesh = extract_surface(field_of(small_sphere, 3, 0.03f));
  ASSERT_GT(mesh.triangles.size(), 1000u);
  for (std::size_t i = 0; i < mesh.vertices_m.size(); ++i) {
    EXPECT_NEAR((mesh.vertices_m[i] - kCentre).norm(), kRadius, 2e-4f);
    EXPECT_GT(mesh.normals[i].dot((mesh.vertices_m[i] - kCentre).normalized()), 0.999f);
  }
  const auto edges = edges_of(mesh);
  for (const auto& [edge, count] : edges) {
    EXPECT_EQ(count, 1);
    EXPECT_TRUE(edges.contains({edge.second, edge.first}));
  }
  // Euler: V − E + F = 2.
  EXPECT_EQ(static_cast<long>(mesh.vertices_m.size()) - static_cast<long>(edges.size() / 2) +
                static_cast<long>(mesh.triangles.size()),
            2);
  double area = 0, volume = 0;
  for (const auto& [a, b, c] : mesh.triangles) {
    const Vector3f across = (mesh.vertices_m[b] - mesh.vertices_m[a]).cross(mesh.vertices_m[c] - mesh.vertices_m[a]);
    area += 0.5 * across.norm();
    volume += mesh.vertices_m[a].dot(across) / 6;
    EXPECT_GE(across.dot(mesh.vertices_m[a] - kCentre), 0) << "triangles turn outwards";
  }
  EXPECT_NEAR(area, 4 * M_PI * kRadius * kRadius, 0.01 * 4 * M_PI * kRadius * kRadius);
  EXPECT_NEAR(volume, 4 * M_PI / 3 * std::pow(kRadius, 3), 0.01 * 4 * M_PI / 3 * std::pow(kRadius, 3));
}

TEST(SurfaceMesh, APlaneThroughGridPoints) {
  // Distances of exactly 0: several edges meet in one vertex and triangles shrink to nothing.
  const SurfaceMesh mesh = extract_surface(field_of([](const Vector3f& p) { return p.z(); }, 1, 0.03f));
  EXPECT_EQ(mesh.vertices_m.size(), 16u * 16u);
  EXPECT_EQ(mesh.triangles.size(), 2u * 15u * 15u);
  for (std::size_t i = 0; i < mesh.vertices_m.size(); ++i) {
    EXPECT_EQ(mesh.vertices_m[i].z(), 0);
    EXPECT_NEAR(mesh.normals[i].z(), 1, 1e-5f) << "also at the border of the known voxels";
  }
}

TEST(SurfaceMesh, UnknownSpaceHasNoSurface) {
  EXPECT_TRUE(extract_surface(DistanceField()).triangles.empty());
  // One side of the surface only.
  EXPECT_TRUE(extract_surface(field_of([](const Vector3f& p) { return p.z() >= 0.001f ? p.z() : 1.0f; }, 1, 0.03f))
                  .triangles.empty());
}

TEST(SurfaceMesh, PlyHoldsEveryVertexAndTriangle) {
  const SurfaceMesh mesh = extract_surface(field_of(small_sphere, 3, 0.03f));
  const auto path =
      std::filesystem::temp_directory_path() / ("lumigraft_surface_mesh_test_" + std::to_string(getpid()) + ".ply");
  write_ply(mesh, path);
  std::ifstream in(path, std::ios::binary);
  std::string line, header;
  while (std::getline(in, line) && line != "end_header") header += line + "\n";
  EXPECT_NE(header.find("element vertex " + std::to_string(mesh.vertices_m.size()) + "\n"), std::string::npos);
  EXPECT_NE(header.find("element face " + std::to_string(mesh.triangles.size()) + "\n"), std::string::npos);
  const auto start = in.tellg();
  float first[6];
  in.read(reinterpret_cast<char*>(first), sizeof(first));
  EXPECT_EQ(first[2], mesh.vertices_m[0].z());
  EXPECT_EQ(first[5], mesh.normals[0].z());
  in.seekg(0, std::ios::end);
  EXPECT_EQ(static_cast<std::size_t>(in.tellg() - start), 24 * mesh.vertices_m.size() + 13 * mesh.triangles.size());
  std::filesystem::remove(path);
  EXPECT_THROW(write_ply(mesh, "/nowhere/at/all.ply"), capture::InputError);
}

}  // namespace
}  // namespace lumigraft::reconstruct
