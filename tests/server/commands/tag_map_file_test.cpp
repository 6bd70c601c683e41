#include "server/commands/tag_map_file.h"

#include <gtest/gtest.h>

#include "reconstruct/pose/tag_map_file.h"
#include "server/commands/parameters.h"
#include "tests/server/tiny_session.h"

namespace lumigraft::server {
namespace {

namespace fs = std::filesystem;

const capture::Tag kTag{"tag36h11", 2, 0.16, {{5, 0.16, Eigen::Isometry3d(Eigen::Translation3d(0.3, 0, 0))}}};

class TagMapFileTest : public testing::Test {
 protected:
  const TinySession folder_{"tag-map"};
  const fs::path file_ = folder_.folder / "session.tags.toml";
  const reconstruct::TagMap::State state_ = reconstruct::TagMap(kTag).state();
  const std::string text_ = reconstruct::tag_map_text(kTag, state_);
};

TEST_F(TagMapFileTest, IsReadAgainAfterARestart) {
  EXPECT_EQ(default_tag_map(folder_.folder / "session.toml"), file_);
  TagMapFile first(file_, kTag);
  EXPECT_FALSE(first.learnt());
  EXPECT_EQ(first.message(), "");
  EXPECT_EQ(first.save(state_), "");
  const TagMapFile second(file_, kTag);
  ASSERT_TRUE(second.learnt());
  EXPECT_EQ(second.message(), file_.string() + ": 2 of 2 tags are located, as learnt before");
}

TEST_F(TagMapFileTest, OneThatCannotBeUsedIsKeptAndOfManyTheNewest) {
  const auto broken_text = [](int i) { return "format = 7\n# " + std::to_string(i); };
  constexpr int kBroken = 7;
  for (int i = 1; i <= kBroken; ++i) {
    const std::string broken = broken_text(i);
    folder_.write("session.tags.toml", broken);
    TagMapFile map(file_, kTag);
    EXPECT_FALSE(map.learnt());
    EXPECT_NE(map.message().find("session.tags.toml:1: format: found 7"), std::string::npos) << map.message();
    EXPECT_NE(map.message().find("the tag map is not used"), std::string::npos) << map.message();
    EXPECT_EQ(folder_.read("session.tags.toml"), broken) << "until there is a better one";
    EXPECT_EQ(map.save(state_), "");
    EXPECT_EQ(map.save(state_), "");
    EXPECT_EQ(folder_.read("session.tags.toml"), text_);
    EXPECT_EQ(folder_.read("session.tags.toml.unused"), broken) << "as the message says";
  }
  for (int i = 2; i <= kCommands.max_unused; ++i)
    EXPECT_EQ(folder_.read("session.tags.toml.unused" + std::to_string(i)), broken_text(kBroken + 1 - i));
  EXPECT_FALSE(fs::exists(file_.string() + ".unused" + std::to_string(kCommands.max_unused + 1)));
}

TEST_F(TagMapFileTest, AFailedSaveIsReportedOnceAndLosesNothing) {
  TagMapFile map(folder_.folder / "absent" / "session.tags.toml", kTag);
  EXPECT_NE(map.save(state_).find("the tag map cannot be saved: "), std::string::npos);
  EXPECT_EQ(map.save(state_), "");
  fs::create_directory(folder_.folder / "absent");
  EXPECT_EQ(map.save(state_), "");
  EXPECT_TRUE(TagMapFile(folder_.folder / "absent" / "session.tags.toml", kTag).learnt());
}

}  // namespace
}  // namespace lumigraft::server
