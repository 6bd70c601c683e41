#include "reconstruct/field/normal_filter.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <memory>
#include <numbers>
#include <random>
#include <utility>

namespace lumigraft::reconstruct {
namespace {

using Eigen::Vector3f;

/// Noise of a measurement's distance by place, the same along an axis: as fusion of one image leaves it.
class Noise {
 public:
  explicit Noise(float sigma_m) : sigma_m_(sigma_m) {}
  float at(float a_m, float b_m, float voxel_m) {
    constexpr float kPatch_voxels = 1.5f;  // a block of pixels at 2 m
    const auto cell = [&](float x_m) { return static_cast<int>(std::floor(x_m / (kPatch_voxels * voxel_m))); };
    const auto [found, is_new] = values_.try_emplace({cell(a_m), cell(b_m)}, 0.0f);
    if (is_new) found->second = sigma_m_ * normal_(random_);
    return found->second;
  }

 private:
  float sigma_m_;
  std::map<std::pair<int, int>, float> values_;
  std::mt19937 random_{7};
  std::normal_distribution<float> normal_;
};

DistanceField field_of(const std::function<float(const Vector3f&)>& distance_m, float weight) {
  constexpr int kReach = 3;
  DistanceField field;
  for (int a = -kReach; a < kReach; ++a)
    for (int b = -kReach; b < kReach; ++b)
      for (int c = -kReach; c < kReach; ++c) {
        auto brick = std::make_shared<FieldBrick>();
        for (int i = 0; i < kBrickVoxels; ++i) {
          const auto index = static_cast<std::size_t>(i);
          const float d = distance_m(field.voxel_m * voxel_in({a, b, c}, i).cast<float>());
          if (std::abs(d) > field.truncation_m) continue;
          brick->distance_m[index] = d;
          brick->weight[index] = weight;
        }
        field.bricks[{a, b, c}] = brick;
      }
  return field;
}

/// RMS angle between normals and those of `exact`, degrees; at vertices for which `counts`.
template <typename Counts>
float error_degrees(const SurfaceMesh& mesh, const std::vector<Vector3f>& normals,
                    const std::function<Vector3f(const Vector3f&)>& exact, Counts counts) {
  double sum = 0;
  int count = 0;
  for (std::size_t i = 0; i < normals.size(); ++i) {
    if (!counts(mesh.vertices_m[i])) continue;
    sum += std::pow(std::acos(std::clamp(normals[i].dot(exact(mesh.vertices_m[i])), -1.0f, 1.0f)), 2);
    ++count;
  }
  EXPECT_GT(count, 200);
  return static_cast<float>(std::sqrt(sum / count) * 180 / std::numbers::pi);
}

std::vector<Vector3f> unfiltered(const DistanceField& field, const SurfaceMesh& mesh) {
  std::vector<Vector3f> normals;
  for (std::size_t i = 0; i < mesh.vertices_m.size(); ++i)
    normals.push_back(field.normal(mesh.vertices_m[i]).value_or(mesh.normals[i]));
  return normals;
}

constexpr float kFew = 0.04f, kMany = 64;  // weights of one image at 2 m, and of hundreds

bool inside(const Vector3f& p_m) { return p_m.cwiseAbs().maxCoeff() < 0.15f; }

TEST(NormalFilter, NoiseOfAPlaneIsAveraged) {
  Noise noise(0.002f);
  const DistanceField field = field_of([&](const Vector3f& p) { return p.z() - noise.at(p.x(), p.y(), 0.008f); }, kFew);
  const SurfaceMesh mesh = extract_surface(field);
  const auto up = [](const Vector3f&) { return Vector3f(0, 0, 1); };
  const float before = error_degrees(mesh, unfiltered(field, mesh), up, inside);
  EXPECT_GT(before, 5);
  EXPECT_LT(error_degrees(mesh, mesh.normals, up, inside), before / 4);
}

// Neighbours of a vertex are not even around it: on curved surface their mean is that of another place.
TEST(NormalFilter, CurvedSurfaceIsNotBent) {
  constexpr float kRadius_m = 0.06f;
  Noise noise(0.0005f);
  const DistanceField field =
      field_of([&](const Vector3f& p) { return p.norm() - kRadius_m - noise.at(p.x(), p.y(), 0.008f); }, kFew);
  const SurfaceMesh mesh = extract_surface(field);
  const auto outwards = [](const Vector3f& p) { return p.normalized(); };
  const auto above = [](const Vector3f& p) { return p.z() > 0.3f * kRadius_m; };
  const float before = error_degrees(mesh, unfiltered(field, mesh), outwards, above);
  EXPECT_LT(error_degrees(mesh, mesh.normals, outwards, above), before);
}

TEST(NormalFilter, EdgesRemain) {
  Noise above(0.002f), beside(0.002f);
  // A solid corner: free above z = 0, and beyond x = 0.
  const DistanceField field = field_of(
      [&](const Vector3f& p) {
        return std::max(p.z() - above.at(p.x(), p.y(), 0.008f), p.x() - beside.at(p.y(), p.z(), 0.008f));
      },
      kFew);
  const SurfaceMesh mesh = extract_surface(field);
  const auto exact = [](const Vector3f& p) { return p.x() < p.z() ? Vector3f(0, 0, 1) : Vector3f(1, 0, 0); };
  // Up to 2 voxels from the edge.
  const auto counts = [](const Vector3f& p) { return inside(p) && std::abs(p.x() - p.z()) > 0.016f; };
  const float before = error_degrees(mesh, unfiltered(field, mesh), exact, counts);
  EXPECT_LT(error_degrees(mesh, mesh.normals, exact, counts), before / 2);
}

TEST(NormalFilter, ReliefThatIsKnownRemains) {
  constexpr float kHigh_m = 0.002f, kPerMetre = 2 * std::numbers::pi_v<float> / 0.06f;
  const DistanceField field =
      field_of([&](const Vector3f& p) { return p.z() - kHigh_m * std::sin(kPerMetre * p.x()); }, kMany);
  const SurfaceMesh mesh = extract_surface(field);
  const std::vector<Vector3f> before = unfiltered(field, mesh);
  const auto up = [](const Vector3f&) { return Vector3f(0, 0, 1); };
  EXPECT_GT(error_degrees(mesh, mesh.normals, up, inside), 0.9f * error_degrees(mesh, before, up, inside));
}

}  // namespace
}  // namespace lumigraft::reconstruct
