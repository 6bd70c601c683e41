#include "relight/objects/mesh_refine.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/relight/exhibit/model_shapes.h"

namespace lumigraft::relight {
namespace {

float longest_edge(const Model& model) {
  float longest = 0;
  for (std::size_t t = 0; t < model.indices.size(); t += 3) {
    for (std::size_t i = 0; i < 3; ++i) {
      longest = std::max(
          longest,
          (model.positions_m[model.indices[t + i]] - model.positions_m[model.indices[t + (i + 1) % 3]]).norm());
    }
  }
  return longest;
}

double area_m2(const Model& model) {
  double sum = 0;
  for (std::size_t t = 0; t < model.indices.size(); t += 3) {
    const Eigen::Vector3f& a = model.positions_m[model.indices[t]];
    sum +=
        0.5 * (model.positions_m[model.indices[t + 1]] - a).cross(model.positions_m[model.indices[t + 2]] - a).norm();
  }
  return sum;
}

Model box_of_two_parts() {
  Model model;
  test::add_part(&model, test::box({0, 0, 0}, {0.4f, 0.2f, 0.1f}));
  test::add_part(&model, test::sphere(0.1f, 12));
  for (std::size_t i = 0; i < model.positions_m.size(); ++i) {
    const Eigen::Vector3f& p = model.positions_m[i];
    model.colors[i] = p;  // linear in space, so it must stay so
    model.texcoords_1.emplace_back(p.y(), p.z());
    model.tangents.emplace_back(p.z(), p.x(), p.y(), 1);
  }
  return model;
}

TEST(ModelRefine, EdgesAreShortTheShapeStaysAndNoGapOpens) {
  const Model model = box_of_two_parts();
  ASSERT_TRUE(is_closed(model));
  const auto fine = refine_model(model, 0.03f);
  EXPECT_LE(longest_edge(*fine), 0.03f);
  EXPECT_TRUE(is_closed(*fine)) << "a halved edge is halved on both sides";
  EXPECT_NEAR(area_m2(*fine), area_m2(model), 1e-6);
  ASSERT_EQ(fine->parts.size(), 2u);
  EXPECT_EQ(fine->parts[0].index_count + fine->parts[1].index_count, fine->indices.size());
  EXPECT_EQ(fine->parts[1].first_index, fine->parts[0].index_count);
  ASSERT_EQ(fine->normals.size(), fine->positions_m.size());
  for (std::size_t i = 0; i < fine->positions_m.size(); ++i) {
    const Eigen::Vector3f& p = fine->positions_m[i];
    EXPECT_LT((fine->colors[i] - p).norm(), 1e-6f);
    EXPECT_LT((fine->texcoords_1.at(i) - p.tail<2>()).norm(), 1e-6f);
    EXPECT_LT((fine->tangents.at(i) - Eigen::Vector4f(p.z(), p.x(), p.y(), 1)).norm(), 1e-6f);
    EXPECT_NEAR(fine->normals[i].norm(), 1, 1e-5f);
  }
}

TEST(ModelRefine, WhatIsFineEnoughStaysAsItIs) {
  const Model model = box_of_two_parts();
  const auto same = refine_model(model, 1);
  EXPECT_EQ(same->indices, model.indices);
  EXPECT_EQ(same->positions_m.size(), model.positions_m.size());
}

/// The box with vertices of its own for each triangle, which differ by rounding, as at seams of texture coordinates.
Model box_of_loose_triangles() {
  Model model = box_of_two_parts();
  const Model joined = model;
  model.positions_m.clear();
  for (std::uint32_t i = 0; i < joined.indices.size(); ++i) {
    const float off_m = i % 2 == 0 ? 2e-8f : -2e-8f;
    model.positions_m.push_back(joined.positions_m[joined.indices[i]] + Eigen::Vector3f::Constant(off_m));
    model.indices[i] = i;
  }
  return model;
}

TEST(ModelRefine, SeamsThatRoundingOpensCountAsClosed) {
  Model model = box_of_loose_triangles();
  EXPECT_TRUE(is_closed(model));
  model.indices.resize(model.indices.size() - 3);
  EXPECT_FALSE(is_closed(model)) << "a hole";
  model = box_of_loose_triangles();
  for (std::size_t i = 0; i < 3; ++i) model.positions_m[i] += Eigen::Vector3f::Constant(0.01f);
  EXPECT_FALSE(is_closed(model)) << "a triangle beside its place";
}

TEST(ModelRefine, AHoleIsFound) {
  Model model = box_of_two_parts();
  model.indices.resize(model.indices.size() - 3);
  model.parts.back().index_count -= 3;
  EXPECT_FALSE(is_closed(model));
}

}  // namespace
}  // namespace lumigraft::relight
