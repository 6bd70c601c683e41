#include "reconstruct/pose/tag_map_file.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <fstream>
#include <random>

#include "capture/error.h"
#include "capture/text_file.h"
#include "reconstruct/pose/pose.h"
#include "tests/reconstruct/pose/tag_table.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector3d;
using Step = Eigen::Matrix<double, 6, 1>;

class TagMapFileText : public testing::Test {
 public:
  ~TagMapFileText() override { std::filesystem::remove(file_); }

 protected:
  TagMapFileText() {
    const char* name = testing::UnitTest::GetInstance()->current_test_info()->name();
    file_ = std::filesystem::temp_directory_path() / (std::string(name) + std::to_string(getpid()) + ".tags.toml");
    TagMap map(tag_);
    std::mt19937 random(5);
    std::normal_distribution<double> gauss(0, 1);
    const auto see = [&](std::size_t a, std::size_t b, const Isometry3d& T_a_b) {
      for (int i = 0; i < 20; ++i) {
        Step noise;
        for (int k = 0; k < 6; ++k) noise[k] = 0.002 * gauss(random);
        map.add_pair(a, b, apply_step(T_a_b, noise));
      }
    };
    see(0, 1, test::lying_at({0.3, 0.1, 0.02}, 0.4));
    see(1, 2, test::lying_at({0.2, -0.4, 0.01}, -1.1));
    map.move(0, *map.T_world_tag(0) * test::lying_at({0.05, 0, 0}, 0.1));
    see(0, 2, test::lying_at({0.35, 0.1, 0.02}, 0.3));
    learnt_ = map.state();
    text_ = tag_map_text(tag_, learnt_);
  }

  TagMap::State read(const std::string& text, const capture::Tag& tag) const {
    capture::write_text(file_, text);
    return read_tag_map(file_, tag);
  }
  std::string with(const std::string& from, const std::string& to) const {
    std::string text = text_;
    const std::size_t at = text.find(from);
    EXPECT_NE(at, std::string::npos) << from;
    return at == std::string::npos ? text : text.replace(at, from.size(), to);
  }
  /// The error of reading `text`.
  std::string refused(const std::string& text, const capture::Tag& tag) const {
    try {
      read(text, tag);
    } catch (const capture::InputError& e) {
      return e.what();
    }
    return "not refused";
  }

  capture::Tag tag_{"tag36h11", 2, 0.16, {{5, 0.16, {}}, {7, 0.1, test::lying_at({0.6, -0.2, 0}, -0.7)}}};
  std::filesystem::path file_;
  TagMap::State learnt_;
  std::string text_;
};

TEST_F(TagMapFileText, IsReadAsItWasWritten) {
  const TagMap::State read_back = read(text_, tag_);
  ASSERT_EQ(read_back.tags.size(), 3u);
  for (std::size_t t = 0; t < 3; ++t) {
    const TagMap::Tag &a = learnt_.tags[t], &b = read_back.tags[t];
    EXPECT_EQ(a.id, b.id);
    ASSERT_TRUE(a.T_world_tag && b.T_world_tag) << t;
    EXPECT_TRUE(a.T_world_tag->isApprox(*b.T_world_tag, 1e-12)) << t;
    EXPECT_EQ(a.held.has_value(), b.held.has_value());
    EXPECT_TRUE(a.covariance.isApprox(b.covariance, 1e-12) || a.covariance.isZero());
    EXPECT_EQ(a.moved_m, b.moved_m);
  }
  ASSERT_EQ(read_back.pairs.size(), learnt_.pairs.size());
  EXPECT_FALSE(learnt_.pairs.empty());
  for (const auto& [ab, pair] : learnt_.pairs) {
    const TagMap::Pair& other = read_back.pairs.at(ab);
    EXPECT_TRUE(pair.mean.isApprox(other.mean, 1e-12));
    EXPECT_TRUE(pair.squares.isApprox(other.squares, 1e-12));
    EXPECT_EQ(pair.count, other.count);
  }
  TagMap map(tag_);
  map.restore(read_back);
  EXPECT_EQ(map.warning(0).substr(0, 25), "tag 2: it was moved by 50");
}

TEST_F(TagMapFileText, ATagThatIsNewInTheConfigurationIsNotLocatedYet) {
  tag_.extra.insert(tag_.extra.begin(), {9, 0.16, {}});
  const TagMap::State state = read(text_, tag_);
  EXPECT_EQ(state.tags[1].id, 9);
  EXPECT_FALSE(state.tags[1].T_world_tag);
  EXPECT_TRUE(state.tags[2].T_world_tag && state.tags[3].T_world_tag);
  EXPECT_TRUE(state.pairs.contains({2, 3}));
}

TEST_F(TagMapFileText, OfOtherTagsIsRefused) {
  capture::Tag other = tag_;
  other.extra[0].id = 6;
  EXPECT_NE(refused(text_, other).find("found 5, allowed: a tag of the configuration"), std::string::npos);
  other = tag_;
  other.extra[1].size_m = 0.11;
  EXPECT_NE(refused(text_, other).find("another size"), std::string::npos);
  other = tag_;
  other.id = 3;
  EXPECT_NE(refused(text_, other).find("found 2, allowed"), std::string::npos);
  other = tag_;
  other.family = "tag25h9";
  EXPECT_NE(refused(text_, other).find("family: found \"tag36h11\""), std::string::npos);
  other = tag_;
  other.extra[1].T_tag_extra = test::lying_at({0.61, -0.2, 0}, -0.7);
  EXPECT_NE(refused(text_, other).find("another pose of tag 7"), std::string::npos);
}

TEST_F(TagMapFileText, ThatIsDamagedIsRefused) {
  EXPECT_NE(refused(with("format = 1", "format = 2"), tag_).find("format: found 2"), std::string::npos);
  for (std::size_t length = 0; length + 2 < text_.size(); length += 97)
    EXPECT_NE(refused(text_.substr(0, length), tag_), "not refused") << length;
  // Cut between two tables the rest is a complete document.
  EXPECT_NE(refused(text_.substr(0, text_.rfind("[[pair]]")), tag_).find("the file is incomplete"), std::string::npos);
  EXPECT_NE(refused(with("T_world_tag = [[", "T_world_tag = [[nan, "), tag_), "not refused");
  EXPECT_NE(refused(with("squared_deviations = [", "squared_deviations = [inf, "), tag_), "not refused");
  EXPECT_NE(refused(with("T_a_b = [[", "T_a_b = [[1"), tag_).find("orthonormal"), std::string::npos);
  EXPECT_NE(refused(with("covariance = [0", "covariance = [-1"), tag_).find("no covariance"), std::string::npos);
  EXPECT_NE(refused(with("sightings = ", "sightings = -"), tag_).find("sightings"), std::string::npos);
  EXPECT_NE(refused(with("tags = [2, 7]", "tags = [7, 2]"), tag_).find("pair"), std::string::npos);
}

// A tag that was learnt beside the first is enough for the pose after a restart, in the first frame.
TEST(TagMapFile, TheFirstTagNeedNotBeSeenAgain) {
  const capture::Tag tag{"tag36h11", 2, 0.16, {{5, 0.16, std::nullopt}}};
  const std::filesystem::path file =
      std::filesystem::temp_directory_path() / ("restart" + std::to_string(getpid()) + ".tags.toml");
  test::TagTable table;
  std::optional<TagMap::State> learnt;
  {
    PoseStage stage(tag, test::small_camera());
    for (unsigned i = 0; i < 120 && !learnt; i += 8) {
      stage.locate(table.seen_from(test::above_the_table(i), i));
      learnt = stage.take_tag_map();
    }
    ASSERT_TRUE(learnt);
    EXPECT_FALSE(stage.take_tag_map()) << "nothing was learnt since";
    capture::write_text(file, tag_map_text(tag, *learnt));
  }
  table.first = false;
  PoseStage forgetful(tag, test::small_camera()), stage(tag, test::small_camera());
  stage.restore_tag_map(read_tag_map(file, tag));
  std::filesystem::remove(file);
  EXPECT_FALSE(forgetful.locate(table.seen_from(test::above_the_table(0), 0)).pose);
  const auto result = stage.locate(table.seen_from(test::above_the_table(0), 0));
  ASSERT_TRUE(result.pose);
  EXPECT_TRUE(result.warnings.empty()) << result.warnings.front();
  EXPECT_LT(test::millimetres_apart(result.pose->T_tag_camera_raw, test::above_the_table(0)), 4);
}

TEST(TagMapFile, OneTagHasNoMap) {
  PoseStage stage({"tag36h11", 2, 0.16}, test::small_camera());
  stage.locate(test::TagTable().seen_from(test::above_the_table(0), 0));
  EXPECT_FALSE(stage.take_tag_map());
}

}  // namespace
}  // namespace lumigraft::reconstruct
