#include "relight/objects/distance_field.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <ctime>
#include <filesystem>
#include <numbers>

#include "capture/camera/srgb.h"
#include "tests/relight/exhibit/model_shapes.h"

namespace lumigraft::relight {
namespace {

using test::box;
using test::model_of;
using test::Points;
using test::sphere;

Eigen::Vector3f centre_of(const ObjectField& field, int i, int j, int k) {
  return field.origin_m + field.voxel_m * Eigen::Vector3f(Eigen::Vector3i(i, j, k).cast<float>());
}

std::size_t index_of(const ObjectField& field, int i, int j, int k) {
  return i + static_cast<std::size_t>(field.size[0]) * (j + static_cast<std::size_t>(field.size[1]) * k);
}

template <typename Function>  // function(centre, distance_m, base_color)
void for_each_voxel(const ObjectField& field, const Function& function) {
  for (int k = 0; k < field.size[2]; ++k) {
    for (int j = 0; j < field.size[1]; ++j) {
      for (int i = 0; i < field.size[0]; ++i) {
        const std::size_t index = index_of(field, i, j, k);
        function(centre_of(field, i, j, k), field.distance_m[index], field.base_color[index]);
      }
    }
  }
}

float trilinear(const ObjectField& field, const Eigen::Vector3f& p) {
  const Eigen::Vector3f at = (p - field.origin_m) / field.voxel_m;
  float sum = 0;
  Eigen::Vector3i low;
  for (int a = 0; a < 3; ++a) low[a] = std::clamp(static_cast<int>(std::floor(at[a])), 0, field.size[a] - 2);
  const Eigen::Vector3f f = at - low.cast<float>();
  for (int n = 0; n < 8; ++n) {
    float weight = 1;
    for (int a = 0; a < 3; ++a) weight *= n >> a & 1 ? f[a] : 1 - f[a];
    sum += weight * field.distance_m[index_of(field, low[0] + (n & 1), low[1] + (n >> 1 & 1), low[2] + (n >> 2 & 1))];
  }
  return sum;
}

float clamped(float distance_m, const ObjectField& field) {
  return std::clamp(distance_m, -3 * field.voxel_m, 3 * field.voxel_m);
}

// Slow and obviously right: the nearest triangle of all, by a dense minimum over each triangle's three features; the
// sign by the sum of solid angles, 4π for a point inside (van Oosterom & Strackee 1983, eq. 8).
double reference_distance_m(const Points& triangles, const Eigen::Vector3d& p) {
  double best = 1e30, solid_angle = 0;
  for (std::size_t c = 0; c < triangles.size(); c += 3) {
    const Eigen::Vector3d a = triangles[c].cast<double>() - p, b = triangles[c + 1].cast<double>() - p,
                          d = triangles[c + 2].cast<double>() - p;
    const Eigen::Vector3d corner[3] = {a, b, d};
    for (int e = 0; e < 3; ++e) {
      const Eigen::Vector3d from = corner[e], along = corner[(e + 1) % 3] - from;
      best = std::min(best, (from + std::clamp(-from.dot(along) / along.squaredNorm(), 0.0, 1.0) * along).norm());
    }
    const Eigen::Vector3d n = (b - a).cross(d - a).normalized();
    const Eigen::Vector3d foot = n * n.dot(a);
    const bool within = (b - a).cross(foot - a).dot(n) >= 0 && (d - b).cross(foot - b).dot(n) >= 0 &&
                        (a - d).cross(foot - d).dot(n) >= 0;
    if (within) best = std::min(best, foot.norm());
    solid_angle += 2 * std::atan2(a.dot(b.cross(d)), a.norm() * b.norm() * d.norm() + a.dot(b) * d.norm() +
                                                         b.dot(d) * a.norm() + d.dot(a) * b.norm());
  }
  return std::abs(solid_angle) > 2 * std::numbers::pi ? -best : best;
}

TEST(ObjectField, GridCoversTheBoxWithThreeVoxelsAround) {
  const auto field = compute_object_field(model_of(box({-1, -2, -3}, {1, 2, 5})), 32);
  EXPECT_FLOAT_EQ(field->voxel_m, 0.25f);
  EXPECT_EQ(field->size, (std::array<int, 3>{8 + 6, 16 + 6, 32 + 6}));
  // The outermost cells of the 32 along z touch the box from within.
  EXPECT_NEAR(field->origin_m.z() - 0.125f, -3 - 0.75f, 1e-5f);
  EXPECT_EQ(field->distance_m.size(), 14u * 22u * 38u);
  EXPECT_EQ(field->base_color.size(), field->distance_m.size());
}

TEST(ObjectField, SphereMatchesItsFormula) {
  const float radius = 0.3f;
  const auto field = compute_object_field(model_of(sphere(radius, 96)), 32);
  for_each_voxel(*field, [&](const Eigen::Vector3f& p, float d, const Eigen::Vector3f&) {
    ASSERT_NEAR(d, clamped(p.norm() - radius, *field), 2e-4f) << p.transpose();  // facets: r (1 - cos(π/192))
  });
}

TEST(ObjectField, BoxMatchesItsFormula) {
  const Eigen::Vector3f half(0.1f, 0.2f, 0.4f), centre(1, 2, 3);
  const auto field = compute_object_field(model_of(box(centre - half, centre + half)), 48);
  for_each_voxel(*field, [&](const Eigen::Vector3f& p, float d, const Eigen::Vector3f&) {
    const Eigen::Vector3f q = (p - centre).cwiseAbs() - half;
    const float expected = q.cwiseMax(0.0f).norm() + std::min(q.maxCoeff(), 0.0f);
    ASSERT_NEAR(d, clamped(expected, *field), 1e-5f) << p.transpose();
  });
}

TEST(ObjectField, MatchesTheSlowReferenceOnACurvedBody) {
  // A turned torus, 0.15 m and 0.06 m, coarse enough for the reference.
  const Points torus =
      test::moved(test::revolved(8, 16,
                                 [](float t) {
                                   const float a = 2 * std::numbers::pi_v<float> * (t == 1.0f ? 0.0f : t);
                                   return Eigen::Vector2f(0.15f + 0.06f * std::cos(a), 0.06f * std::sin(a));
                                 }),
                  Eigen::Affine3f(Eigen::AngleAxisf(0.7f, Eigen::Vector3f(1, 2, 0.5f).normalized())));
  const auto field = compute_object_field(model_of(torus), 18);
  int inside = 0;
  for_each_voxel(*field, [&](const Eigen::Vector3f& p, float d, const Eigen::Vector3f&) {
    const auto expected = static_cast<float>(reference_distance_m(torus, p.cast<double>()));
    ASSERT_NEAR(d, clamped(expected, *field), 1e-5f) << p.transpose();
    inside += d < 0;
  });
  EXPECT_GT(inside, 200);
}

// A sheet, a rectangle of two edges from a corner, is hit at each point more than a voxel from its rim: the
// interpolated field is negative there, and positive again beyond a voxel and a half.
struct Sheet {
  Eigen::Vector3f corner, u, v;
};

void expect_hit_everywhere(const Points& triangles, const Sheet& sheet, int edge_voxels) {
  const auto field = compute_object_field(model_of(triangles), edge_voxels);
  const Eigen::Vector3f normal = sheet.u.cross(sheet.v).normalized();
  const auto fraction = [&](int n, const Eigen::Vector3f& edge) {
    const float rim = field->voxel_m / edge.norm();
    return rim + (1 - 2 * rim) * static_cast<float>(n) / 40;
  };
  for (int m = 0; m <= 40; ++m) {
    for (int n = 0; n <= 40; ++n) {
      const Eigen::Vector3f p = sheet.corner + sheet.u * fraction(m, sheet.u) + sheet.v * fraction(n, sheet.v);
      ASSERT_LT(trilinear(*field, p), 0.0f) << p.transpose();
      ASSERT_GT(trilinear(*field, p + 1.6f * field->voxel_m * normal), 0.0f) << p.transpose();
      ASSERT_GT(trilinear(*field, p - 1.6f * field->voxel_m * normal), 0.0f) << p.transpose();
    }
  }
}

TEST(ObjectField, ThinPlatesAreHitEverywhere) {
  // About 1 m across at 32 voxels: a voxel is 31 mm, the plates are 1 mm thick.
  for (int axis = 0; axis < 3; ++axis) {
    for (float offset : {0.0f, 0.011f}) {
      Eigen::Vector3f low(-0.5f, -0.5f, -0.5f), high(0.5f, 0.5f, 0.5f);
      low[axis] = offset;
      high[axis] = offset + 0.001f;
      Sheet sheet{low, Eigen::Vector3f::Unit((axis + 1) % 3), Eigen::Vector3f::Unit((axis + 2) % 3)};
      sheet.corner[axis] += 0.0005f;
      // A block far above moves the plate against the grid.
      Points plate = box(low, high);
      const Points block = box(Eigen::Vector3f::Constant(0.7f), Eigen::Vector3f::Constant(0.9f + offset));
      plate.insert(plate.end(), block.begin(), block.end());
      expect_hit_everywhere(plate, sheet, 32);
    }
  }
  for (float angle : {0.1f, 0.6f, 0.9553f}) {
    const Eigen::Affine3f T(Eigen::AngleAxisf(angle, Eigen::Vector3f(1, -1, 0.1f).normalized()));
    const Sheet sheet{T * Eigen::Vector3f(-0.5f, -0.4f, 0.0005f), T.linear() * Eigen::Vector3f(1, 0, 0),
                      T.linear() * Eigen::Vector3f(0, 0.8f, 0)};
    expect_hit_everywhere(test::moved(box({-0.5f, -0.4f, 0}, {0.5f, 0.4f, 0.001f}), T), sheet, 32);
  }
}

TEST(ObjectField, OpenSheetsAreHitEverywhere) {
  for (float angle : {0.0f, 0.2f, 0.7854f, 0.9553f, 1.3f}) {
    for (bool with_back : {false, true}) {
      const Eigen::Affine3f T(Eigen::AngleAxisf(angle, Eigen::Vector3f(1, -1, 0).normalized()));
      const Sheet sheet{T * Eigen::Vector3f(-0.5f, -0.5f, 0), T.linear() * Eigen::Vector3f(1, 0, 0),
                        T.linear() * Eigen::Vector3f(0, 1, 0)};
      const Eigen::Vector3f a = sheet.corner, b = a + sheet.u, c = b + sheet.v, d = a + sheet.v;
      Points triangles;
      test::add_quad(&triangles, a, b, c, d);
      if (with_back) test::add_quad(&triangles, a, d, c, b);
      expect_hit_everywhere(triangles, sheet, 32);
    }
  }
}

TEST(ObjectField, ShellsAreHalfAVoxelThickToEachSide) {
  Points sheet;
  test::add_quad(&sheet, {-1, -1, 0}, {1, -1, 0}, {1, 1, 0}, {-1, 1, 0});
  const auto field = compute_object_field(model_of(sheet), 20);
  const int i = field->size[0] / 2, j = field->size[1] / 2;
  for (int k = 0; k < field->size[2]; ++k) {
    const float expected = std::abs(centre_of(*field, i, j, k).z()) - 0.51f * field->voxel_m;
    EXPECT_NEAR(field->distance_m[index_of(*field, i, j, k)], clamped(expected, *field), 1e-5f);
  }
}

TEST(ObjectField, OpenHemisphereIsHollow) {
  const float radius = 0.3f;
  const auto field = compute_object_field(model_of(sphere(radius, 64, 0.5f)), 48);
  const float h = field->voxel_m;
  for_each_voxel(*field, [&](const Eigen::Vector3f& p, float d, const Eigen::Vector3f&) {
    if (p.z() > -2 * h) return;
    ASSERT_NEAR(d, clamped(std::abs(p.norm() - radius) - 0.51f * h, *field), 1e-3f) << p.transpose();
  });
}

TEST(ObjectField, SmallHolesDontOpenABody) {
  Points ball = sphere(0.3f, 32);
  ball.erase(ball.begin() + 3 * 900, ball.begin() + 3 * 920);
  const auto field = compute_object_field(model_of(ball), 32);
  EXPECT_LT(trilinear(*field, {0, 0, 0}), -2.9f * field->voxel_m);
  EXPECT_GT(trilinear(*field, {0.33f, 0, 0}), 0);
}

TEST(ObjectField, SignsOfNestedParts) {
  const auto at_centre = [](const std::vector<Points>& parts) {
    Model model;
    for (const Points& part : parts) test::add_part(&model, part);
    const auto field = compute_object_field(model, 40);
    // At the centre, between the two spheres, and outside, beyond the band in each case.
    return std::array<float, 3>{trilinear(*field, {0, 0, 0}) / field->voxel_m,
                                trilinear(*field, {0.22f, 0, 0}) / field->voxel_m,
                                trilinear(*field, {0.25f, 0.25f, 0.25f}) / field->voxel_m};
  };
  const Points outer = sphere(0.3f, 32), inner = sphere(0.12f, 32);
  const auto solid = at_centre({outer, inner});
  EXPECT_LT(solid[0], -2.9f);
  EXPECT_LT(solid[1], -2.9f);
  EXPECT_GT(solid[2], 2.9f);
  const auto hollow = at_centre({outer, test::inside_out(inner)});
  EXPECT_GT(hollow[0], 2.9f);
  EXPECT_LT(hollow[1], -2.9f);
  EXPECT_GT(hollow[2], 2.9f);
  const auto wrong_way = at_centre({test::inside_out(outer)});
  EXPECT_LT(wrong_way[0], -2.9f);
  EXPECT_GT(wrong_way[2], 2.9f);
  // Bodies that overlap: inside both is inside.
  const auto overlapping = at_centre({outer, test::moved(outer, Eigen::Affine3f(Eigen::Translation3f(0.3f, 0, 0)))});
  EXPECT_LT(overlapping[0], 0.0f);
  EXPECT_LT(overlapping[1], -2.0f);
}

TEST(ObjectField, ColorsOfTheNearestPart) {
  Model model;
  Material red, blue;
  red.base_color = {0.8f, 0.1f, 0.1f};
  blue.base_color = {0.1f, 0.1f, 0.8f};
  test::add_part(&model, box({-1, -1, -1}, {-0.1f, 1, 1}), red);
  test::add_part(&model, box({0.1f, -1, -1}, {1, 1, 1}), blue);
  for (std::size_t v = 0; v < model.colors.size(); ++v) model.colors[v] = {1, 1, 0.5f};
  const auto field = compute_object_field(model, 40);
  for_each_voxel(*field, [&](const Eigen::Vector3f& p, float d, const Eigen::Vector3f& color) {
    if (std::abs(d) >= 2.99f * field->voxel_m) return;
    const Eigen::Vector3f expected = p.x() < 0 ? Eigen::Vector3f(0.8f, 0.1f, 0.05f) : Eigen::Vector3f(0.1f, 0.1f, 0.4f);
    ASSERT_LT((color - expected).norm(), 1e-5f) << p.transpose();
  });
  for (const float x : {-0.5f, 0.5f}) {
    const Eigen::Vector3i at =
        ((Eigen::Vector3f(x, 0, 1) - field->origin_m) / field->voxel_m).array().round().cast<int>();
    EXPECT_EQ(field->part[index_of(*field, at.x(), at.y(), at.z())], x < 0 ? 0u : 1u);
  }
}

TEST(ObjectField, MetallicOfItsTexture) {
  Model model;
  auto halves = std::make_shared<capture::Image<std::uint8_t>>(2, 1, 3, std::uint8_t{0});
  halves->at(1, 0, 2) = 255;
  const Points corners = box({-1, -1, -1}, {1, 1, 1});
  std::vector<Eigen::Vector2f> texcoords;
  for (const Eigen::Vector3f& p : corners) texcoords.emplace_back((p.x() + 1) / 2, 0.5f);
  test::add_part(&model, corners, {}, nullptr, texcoords);
  model.parts[0].metallic_roughness_texture.picture = halves;
  const auto field = compute_object_field(model, 40);
  for (const float x : {-0.5f, 0.5f}) {
    const Eigen::Vector3i at =
        ((Eigen::Vector3f(x, 0, 1) - field->origin_m) / field->voxel_m).array().round().cast<int>();
    EXPECT_NEAR(field->metallic[index_of(*field, at.x(), at.y(), at.z())], x < 0 ? 0 : 1, 0.06f) << x;
  }
}

TEST(ObjectField, TexturesAreLinearAndAveragedOverAVoxel) {
  Material material;
  material.base_color = {1, 0.5f, 1};
  Points sheet;
  test::add_quad(&sheet, {0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0});
  const std::vector<Eigen::Vector2f> texcoords = {{0, 0}, {1, 0}, {1, 1}, {0, 0}, {1, 1}, {0, 1}};

  // Left half black, right half 188: the plain texture value.
  auto halves = std::make_shared<capture::Image<std::uint8_t>>(32, 32, 3);
  // Black and white texels in turn, eight to a voxel: half the light, which isn't code 128.
  auto checks = std::make_shared<capture::Image<std::uint8_t>>(256, 256, 3);
  for (int y = 0; y < 256; ++y) {
    for (int x = 0; x < 256; ++x) {
      for (int c = 0; c < 3; ++c) {
        if (x < 32 && y < 32) halves->at(x, y, c) = x < 16 ? 0 : 188;
        checks->at(x, y, c) = (x + y) % 2 == 0 ? 255 : 0;
      }
    }
  }
  Model model;
  test::add_part(&model, sheet, material, halves, texcoords);
  const auto field = compute_object_field(model, 32);
  const int k = field->size[2] / 2, j = 20;
  EXPECT_LT(field->base_color[index_of(*field, 6, j, k)].norm(), 1e-6f);
  const Eigen::Vector3f grey = capture::srgb_to_linear(188 / 255.0f) * Eigen::Vector3f(1, 0.5f, 1);
  EXPECT_LT((field->base_color[index_of(*field, 30, j, k)] - grey).norm(), 1e-5f);

  Model fine;
  test::add_part(&fine, sheet, material, checks, texcoords);
  const auto averaged = compute_object_field(fine, 32);
  for (int i = 4; i < 34; ++i) {
    EXPECT_LT((averaged->base_color[index_of(*averaged, i, j, k)] - Eigen::Vector3f(0.5f, 0.25f, 0.5f)).norm(), 1e-5f);
  }
}

TEST(ObjectField, SameBytesEachTime) {
  Model model;
  test::add_part(&model, sphere(0.3f, 24));
  test::add_part(&model, box({0, 0, 0}, {0.5f, 0.4f, 0.002f}));
  const auto a = compute_object_field(model, 24), b = compute_object_field(model, 24);
  ASSERT_EQ(a->distance_m.size(), b->distance_m.size());
  EXPECT_EQ(std::memcmp(a->distance_m.data(), b->distance_m.data(), a->distance_m.size() * sizeof(float)), 0);
  EXPECT_EQ(std::memcmp(a->base_color.data(), b->base_color.data(), a->base_color.size() * sizeof(Eigen::Vector3f)), 0);
}

TEST(ObjectField, LargeModelsOfOthers) {
  const char* extra = std::getenv("LUMIGRAFT_EXTRA");
  if (!extra) GTEST_SKIP() << "set LUMIGRAFT_EXTRA to the folder that holds sessions/ and data/ to run this";
  for (const char* path : {"sessions/tabletop/models/00.ply", "data/meshes/bunny.ply", "data/meshes/spot/spot.obj"}) {
    const std::filesystem::path file = std::filesystem::path(extra) / path;
    if (!std::filesystem::exists(file)) continue;
    const auto model = load_model(file, 'z');
    const std::clock_t start = std::clock();
    const auto field = compute_object_field(*model, 96);
    const double ms = 1000.0 * static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
    std::printf("%-34s %6zu triangles %d x %d x %d voxels %6.0f CPU ms\n", path, model->indices.size() / 3,
                field->size[0], field->size[1], field->size[2], ms);
    // Scans with holes and all are bodies: some voxels lie deep inside.
    const auto deep = std::count_if(field->distance_m.begin(), field->distance_m.end(),
                                    [&](float d) { return d < -2.99f * field->voxel_m; });
    EXPECT_GT(deep, static_cast<std::ptrdiff_t>(field->distance_m.size() / 20)) << path;
    // Neighbours differ by no more than their distance: no leaks of the sign.
    int jumps = 0;
    for (int k = 0; k < field->size[2]; ++k) {
      for (int j = 0; j < field->size[1]; ++j) {
        for (int i = 1; i < field->size[0]; ++i) {
          jumps += std::abs(field->distance_m[index_of(*field, i, j, k)] -
                            field->distance_m[index_of(*field, i - 1, j, k)]) > 1.6f * field->voxel_m;
        }
      }
    }
    std::printf("  %d of %zu neighbours jump\n", jumps, field->distance_m.size());
    EXPECT_LT(jumps, static_cast<int>(field->distance_m.size() / 1000)) << path;
  }
}

}  // namespace
}  // namespace lumigraft::relight
