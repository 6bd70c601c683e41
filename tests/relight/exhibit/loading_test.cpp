#include "relight/exhibit/loading.h"

#include <gtest/gtest.h>

#include "capture/error.h"
#include "tests/relight/exhibit/gltf/animated_files.h"
#include "tests/relight/exhibit/gltf/variant_files.h"
#include "tests/relight/exhibit/model_files.h"

namespace lumigraft::relight {
namespace {

class LoadLater : public ::testing::Test {
 protected:
  LoadLater() {
    folder_.write("variants.gltf", test::grey_red_or_blue().gltf());
    folder_.write("moving.gltf", test::moving_triangle().gltf());
    folder_.write("broken.glb", std::string(10'000, 'x'));
    folder_.write("small.ply", test::ply_square());
  }

  /// Files of more than 500 bytes are loaded later.
  Exhibit read(const std::string& toml) {
    const capture::ConfigTable root = capture::ConfigTable::load(folder_.write("exhibit.toml", toml));
    Exhibit exhibit = read_exhibit(root, 500, &later_);
    root.finish();
    return exhibit;
  }
  static std::string error_of(const std::function<void()>& action) {
    try {
      action();
    } catch (const capture::InputError& error) {
      return error.what();
    }
    return "";
  }

  test::TemporaryFolder folder_;
  std::vector<UnloadedObject> later_;
};

TEST_F(LoadLater, LargeFilesAlone) {
  Exhibit exhibit = read(
      "[[object]]\nmodel = \"small.ply\"\n[[object]]\nname = \"large\"\nmodel = \"variants.gltf\"\n"
      "size_m = 0.5\nvariant = \"blue\"\n");
  ASSERT_EQ(exhibit.objects.size(), 2u);
  EXPECT_NE(exhibit.objects[0].model, nullptr);
  VirtualObject& large = exhibit.objects[1];
  EXPECT_EQ(large.model, nullptr);
  EXPECT_FALSE(large.drawn(0));
  ASSERT_EQ(later_.size(), 1u);
  EXPECT_EQ(later_[0].index, 1u);
  EXPECT_EQ(later_[0].name, "large");

  std::vector<float> reported;
  const GiveModel give = later_[0].load([&](float done) { reported.push_back(done); });
  EXPECT_GT(reported.size(), 2u);
  EXPECT_TRUE(std::ranges::is_sorted(reported));
  EXPECT_EQ(reported.front(), 0);
  EXPECT_EQ(reported.back(), 1);
  large.position_m = {1, 2, 3};  // as a viewer moved it meanwhile
  give(large);
  ASSERT_NE(large.model, nullptr);
  EXPECT_EQ(large.variant, 1u);
  EXPECT_NEAR(large.scale, 0.5, 1e-6);
  EXPECT_EQ(large.position_m, Eigen::Vector3d(1, 2, 3));
}

TEST_F(LoadLater, ObjectsOfOneFileShareItsModel) {
  Exhibit exhibit = read(
      "[[object]]\nname = \"a\"\nmodel = \"moving.gltf\"\n[[object]]\nname = \"b\"\n"
      "model = \"moving.gltf\"\n[object.animation]\nat_s = 0.25\nplaying = false\n");
  ASSERT_EQ(later_.size(), 2u);
  for (std::size_t i = 0; i < 2; ++i) later_[i].load({})(exhibit.objects[i]);
  EXPECT_EQ(exhibit.objects[0].model, exhibit.objects[1].model);
  EXPECT_EQ(exhibit.objects[0].animation->held_s, std::nullopt);
  EXPECT_EQ(exhibit.objects[1].animation->held_s, 0.25);
}

TEST_F(LoadLater, FaultsNameTheirPlace) {
  Exhibit exhibit = read(
      "[[object]]\nname = \"a\"\nmodel = \"broken.glb\"\n[[object]]\nname = \"b\"\n"
      "model = \"variants.gltf\"\nvariant = \"green\"\n");
  const std::string of_file = error_of([&] { later_.at(0).load({}); });
  EXPECT_NE(of_file.find("exhibit.toml"), std::string::npos) << of_file;
  EXPECT_NE(of_file.find("broken.glb: not a model that can be read"), std::string::npos) << of_file;
  const GiveModel give = later_.at(1).load({});
  const std::string of_key = error_of([&] { give(exhibit.objects[1]); });
  EXPECT_NE(of_key.find("variant"), std::string::npos) << of_key;
  EXPECT_NE(of_key.find("found \"green\""), std::string::npos) << of_key;
}

}  // namespace
}  // namespace lumigraft::relight
