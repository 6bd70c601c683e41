#include "relight/objects/mesh_simplify.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <map>
#include <set>

#include "relight/objects/closest_point.h"
#include "tests/relight/exhibit/model_shapes.h"

namespace lumigraft::relight {
namespace {

// Distances from the first corners and the centres of one model's triangles to the other model, sorted.
std::vector<float> distances_m(const Model& from, const Model& to) {
  const ObjectSurface surface(to);
  std::vector<float> all;
  for (std::size_t c = 0; c < from.indices.size(); c += 3) {
    const auto p = [&](int k) { return from.positions_m[from.indices[c + k]]; };
    all.push_back(surface.nearest(p(0), 1e9f)->distance_m);
    all.push_back(surface.nearest((p(0) + p(1) + p(2)) / 3, 1e9f)->distance_m);
  }
  std::sort(all.begin(), all.end());
  return all;
}

void expect_sound(const Model& model) {
  std::uint32_t next = 0;
  for (const Model::Part& part : model.parts) {
    EXPECT_EQ(part.first_index, next);
    EXPECT_GE(part.index_count, 3u);
    next += part.index_count;
  }
  EXPECT_EQ(next, model.indices.size());
  std::set<std::uint32_t> used(model.indices.begin(), model.indices.end());
  EXPECT_EQ(used.size(), model.positions_m.size());
  EXPECT_EQ(*used.rbegin() + 1, model.positions_m.size());
  EXPECT_EQ(model.normals.size(), model.positions_m.size());
  EXPECT_EQ(model.texcoords.size(), model.positions_m.size());
  EXPECT_EQ(model.colors.size(), model.positions_m.size());
}

// Vertices shared and normals smooth, as a loaded model has them.
Model smooth_sphere(float radius_m, int steps) {
  Model model;
  test::add_part(&model, test::sphere(radius_m, steps));
  Model joined = model;
  joined.positions_m.clear();
  joined.normals.clear();
  joined.texcoords.clear();
  joined.colors.clear();
  std::map<std::array<float, 3>, std::uint32_t> known;
  for (std::uint32_t& i : joined.indices) {
    const Eigen::Vector3f p = model.positions_m[i];
    const auto [at, fresh] = known.try_emplace({p.x(), p.y(), p.z()}, static_cast<std::uint32_t>(known.size()));
    if (fresh) {
      joined.positions_m.push_back(p);
      joined.normals.push_back(p.normalized());
      joined.texcoords.push_back({p.x(), p.y()});
      joined.colors.push_back(p.cwiseAbs());
      joined.texcoords_1.push_back({p.y(), p.z()});
      joined.tangents.push_back({p.z(), p.x(), p.y(), 1});
    }
    i = at->second;
  }
  return joined;
}

TEST(SimplifyModel, SphereStaysASphere) {
  const Model model = smooth_sphere(0.5f, 64);
  const auto small = simplify_model(model, 800);
  expect_sound(*small);
  EXPECT_LE(small->indices.size() / 3, 800u);
  EXPECT_GT(small->indices.size() / 3, 600u);
  for (std::size_t v = 0; v < small->positions_m.size(); ++v) {  // attributes stayed with their vertices
    const Eigen::Vector3f& p = small->positions_m[v];
    ASSERT_LT((small->normals[v] - p.normalized()).norm(), 1e-5f);
    ASSERT_LT((small->colors[v] - p.cwiseAbs()).norm(), 1e-6f);
    ASSERT_LT((small->texcoords[v] - p.head<2>()).norm(), 1e-6f);
    ASSERT_LT((small->texcoords_1.at(v) - p.tail<2>()).norm(), 1e-6f);
    ASSERT_LT((small->tangents.at(v) - Eigen::Vector4f(p.z(), p.x(), p.y(), 1)).norm(), 1e-6f);
  }
  const float there = distances_m(model, *small).back(), back = distances_m(*small, model).back();
  std::printf("Hausdorff distance of 8064 to %zu triangles: %.4f and %.4f of the radius\n", small->indices.size() / 3,
              there / 0.5f, back / 0.5f);
  EXPECT_LT(std::max(there, back), 0.03f * 0.5f);
}

TEST(SimplifyModel, KeepsPartsAndTheirMaterials) {
  Model model;
  Material red;
  red.base_color = {1, 0, 0};
  test::add_part(&model, test::sphere(0.5f, 32), red);
  test::add_part(&model, test::box({1, 1, 1}, {2, 2, 2}));
  const auto small = simplify_model(model, 500);
  expect_sound(*small);
  ASSERT_EQ(small->parts.size(), 2u);
  EXPECT_EQ(small->parts[0].material.base_color, red.base_color);
  EXPECT_LE(small->indices.size() / 3, 700u);  // flat-shaded: every edge is a seam, still it gets there
}

TEST(SimplifyModel, SmallModelsStayAsTheyAre) {
  const Model model = test::model_of(test::box({0, 0, 0}, {1, 1, 1}));
  const auto same = simplify_model(model, 12);
  EXPECT_EQ(same->indices, model.indices);
  EXPECT_EQ(same->positions_m, model.positions_m);
}

TEST(SimplifyModel, LargeModelsOfOthers) {
  const char* extra = std::getenv("LUMIGRAFT_EXTRA");
  if (!extra) GTEST_SKIP() << "set LUMIGRAFT_EXTRA to the folder that holds sessions/ and data/ to run this";
  const std::filesystem::path file = std::filesystem::path(extra) / "sessions/tabletop/models/00.ply";
  if (!std::filesystem::exists(file)) GTEST_SKIP() << file << " is not there";
  const auto model = load_model(file, 'z');
  const std::clock_t start = std::clock();
  const auto small = simplify_model(*model, 8700);
  const double ms = 1000.0 * static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
  expect_sound(*small);
  Eigen::AlignedBox3f box;
  for (const auto& p : model->positions_m) box.extend(p);
  const std::vector<float> there = distances_m(*model, *small), back = distances_m(*small, *model);
  const float edge_m = box.sizes().maxCoeff();
  std::printf(
      "%zu to %zu triangles in %.0f CPU ms, %.0f mm large: Hausdorff %.2f mm there, %.2f mm back, 99.9 %% within %.2f "
      "mm\n",
      model->indices.size() / 3, small->indices.size() / 3, ms, 1000 * edge_m, 1000 * there.back(), 1000 * back.back(),
      1000 * there[there.size() * 999 / 1000]);
  EXPECT_LE(small->indices.size() / 3, 8700u);
  EXPECT_LT(back.back(), 0.01f * edge_m);
  // Simplification removes specks of eight triangles next to the body, so the maximum distance is not checked here.
  EXPECT_LT(there[there.size() * 999 / 1000], 0.005f * edge_m);
}

}  // namespace
}  // namespace lumigraft::relight
