#include "relight/objects/prepared_models.h"

#include <gtest/gtest.h>

#include <stdexcept>

namespace lumigraft::test {
namespace {

std::shared_ptr<const int> made(const std::shared_ptr<const relight::Model>& model) {
  return std::make_shared<const int>(static_cast<int>(model->positions_m.size()));
}

relight::VirtualObject object(std::size_t vertices, bool visible) {
  auto model = std::make_shared<relight::Model>();
  model->positions_m.resize(vertices);
  relight::VirtualObject object;
  object.name = std::to_string(vertices);
  object.model = std::move(model);
  object.visible = visible;
  return object;
}

TEST(PreparedModels, VisibleOnesFirstThenHiddenOnesAndOneAtATime) {
  relight::PreparedModels<int> models(made);
  relight::Exhibit exhibit;
  exhibit.objects = {object(1, false), object(2, true)};
  const auto has = [&](std::size_t i) { return models.find(exhibit.objects[i].model) != nullptr; };
  std::vector<std::string> preparing;
  EXPECT_FALSE(only_prepared(exhibit, models, &preparing).objects[1].visible);
  EXPECT_EQ(preparing, std::vector<std::string>{"2"});
  ASSERT_TRUE(models.wants(exhibit));
  models.prepare_next(exhibit);
  EXPECT_TRUE(has(1));
  EXPECT_FALSE(has(0));
  ASSERT_TRUE(models.wants(exhibit));
  models.prepare_next(exhibit);
  EXPECT_EQ(*models.find(exhibit.objects[0].model), 1);
  EXPECT_FALSE(models.wants(exhibit));
  preparing.clear();
  EXPECT_TRUE(only_prepared(exhibit, models, &preparing).objects[1].visible);
  EXPECT_TRUE(preparing.empty());
}

// Three vertices are one too many for it.
TEST(PreparedModels, OneThatCannotBePreparedHoldsUpNoOther) {
  relight::PreparedModels<int> models([](const std::shared_ptr<const relight::Model>& model) {
    if (model->positions_m.size() == 3) throw std::runtime_error("too large");
    return made(model);
  });
  relight::Exhibit exhibit;
  exhibit.objects = {object(3, true), object(2, true)};
  EXPECT_THROW(models.prepare_next(exhibit), std::runtime_error);
  ASSERT_TRUE(models.wants(exhibit));
  models.prepare_next(exhibit);
  EXPECT_TRUE(models.find(exhibit.objects[1].model));
  EXPECT_FALSE(models.find(exhibit.objects[0].model));
  EXPECT_FALSE(models.wants(exhibit)) << "it is not tried for ever";
}

TEST(PreparedModels, ThoseOfNoObjectAreForgotten) {
  relight::PreparedModels<int> models(made);
  relight::Exhibit exhibit;
  exhibit.objects = {object(3, true)};
  const auto gone = exhibit.objects[0].model;
  models.prepare_next(exhibit);
  ASSERT_TRUE(models.find(gone));
  exhibit.objects = {object(4, true)};
  EXPECT_TRUE(models.wants(exhibit));
  models.prepare_next(exhibit);
  EXPECT_FALSE(models.find(gone));
}

}  // namespace
}  // namespace lumigraft::test
