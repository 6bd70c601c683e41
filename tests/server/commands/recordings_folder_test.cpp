#include "server/commands/recordings_folder.h"

#include <gtest/gtest.h>

#include <chrono>
#include <fstream>
#include <set>
#include <utility>

namespace lumigraft::server {
namespace {

namespace fs = std::filesystem;

class RecordingsFolderTest : public testing::Test {
 protected:
  RecordingsFolderTest() : root_(fs::path(testing::TempDir()) / "lumigraft-recordings-folder") {
    fs::remove_all(root_);
    fs::create_directories(root_ / "recorded");
  }
  void TearDown() override { fs::remove_all(root_); }

  /// A recording of 100 kB that began `age` hours ago.
  void add(const std::string& name, int age, bool marked = true) const {
    const fs::path folder = root_ / "recorded" / name;
    fs::create_directory(folder);
    std::ofstream(folder / "color.mkv") << std::string(100'000, 'x');
    if (!marked) return;
    RecordingsFolder::mark(folder);
    fs::last_write_time(folder / RecordingsFolder::kMark, fs::file_time_type::clock::now() - std::chrono::hours(age));
  }
  std::set<std::string> left() const {
    std::set<std::string> names;
    for (const auto& entry : fs::directory_iterator(root_ / "recorded")) names.insert(entry.path().filename());
    return names;
  }
  fs::path at(const std::string& name) const { return root_ / "recorded" / name; }
  RecordingsFolder folder(double max_total_gb, double min_free_gb, RecordingsFolder::FreeBytes free_bytes) const {
    return RecordingsFolder(root_ / "recorded",
                            {.max_s = 600, .max_total_gb = max_total_gb, .min_free_gb = min_free_gb},
                            std::move(free_bytes));
  }

  const fs::path root_;
};

using Names = std::set<std::string>;

std::uintmax_t plenty(const fs::path&) { return 1'000'000'000'000; }

TEST_F(RecordingsFolderTest, TheNewestIsNewestAlsoWhereTheClockWasSetBack) {
  add("before", -1);  // an hour in the future
  fs::create_directory(at("after"));
  std::ofstream(at("after") / "color.mkv") << std::string(100'000, 'x');
  RecordingsFolder::mark(at("after"));
  EXPECT_EQ(folder(0.00015, 0.1, plenty).make_room({}), "");
  EXPECT_EQ(left(), Names{"after"});
}

TEST_F(RecordingsFolderTest, TheOldestGoWhereAllTakeTooMuch) {
  add("c", 1);
  add("a", 3);
  add("b", 2);
  EXPECT_EQ(folder(350e-6, 0.1, plenty).make_room({}), "");
  EXPECT_EQ(left(), (Names{"a", "b", "c"}));
  EXPECT_EQ(folder(250e-6, 0.1, plenty).make_room({}), "");
  EXPECT_EQ(left(), (Names{"b", "c"}));
}

TEST_F(RecordingsFolderTest, TheOneThatIsWrittenStaysAndSaysSo) {
  add("now", 9);
  add("old", 5);
  const std::string reason = folder(50e-6, 0.1, plenty).make_room(at("now"));
  EXPECT_EQ(left(), (Names{"now", "old"})) << "none is removed in vain";
  EXPECT_EQ(reason,
            "recordings take more than 5e-05 GB (server.max_recordings_gb), and removing older ones would not suffice");
  EXPECT_EQ(folder(150e-6, 0.1, plenty).make_room(at("now")), "");
  EXPECT_EQ(left(), (Names{"now"})) << "though it is older";
}

TEST_F(RecordingsFolderTest, TheDisksReserveIsKept) {
  add("a", 3);
  add("b", 2);
  add("c", 1);
  const auto misses = [](std::uintmax_t bytes) {
    return [bytes](const fs::path&) { return std::uintmax_t{1'000'000'000} - bytes; };
  };
  EXPECT_EQ(folder(1, 1, misses(0)).make_room({}), "");
  EXPECT_EQ(left(), (Names{"a", "b", "c"}));
  EXPECT_EQ(folder(1, 1, misses(150'000)).make_room({}), "");
  EXPECT_EQ(left(), (Names{"c"}));
  EXPECT_EQ(
      folder(1, 1, misses(150'000)).make_room({}),
      "less than 1 GB are free on the disk of recordings (server.min_free_disk_gb), and removing older ones would "
      "not suffice");
  EXPECT_EQ(left(), (Names{"c"}));
}

TEST_F(RecordingsFolderTest, WhatNoServiceMadeIsNeitherCountedNorRemoved) {
  add("mine", 9, false);
  add("a", 3);
  std::ofstream(root_ / "recorded" / "notes.txt") << std::string(100'000, 'x');
  fs::create_directory(root_ / "elsewhere");
  RecordingsFolder::mark(root_ / "elsewhere");
  fs::create_directory_symlink(root_ / "elsewhere", at("link"));
  EXPECT_EQ(folder(150e-6, 0.1, plenty).make_room({}), "");
  EXPECT_EQ(left(), (Names{"a", "link", "mine", "notes.txt"}));
  EXPECT_EQ(folder(50e-6, 0.1, plenty).make_room({}), "");
  EXPECT_EQ(left(), (Names{"link", "mine", "notes.txt"}));
  EXPECT_TRUE(fs::exists(root_ / "elsewhere" / RecordingsFolder::kMark));
}

TEST_F(RecordingsFolderTest, TwoWithinASecondHaveTwoNames) {
  const RecordingsFolder recordings = folder(1, 1, plenty);
  const fs::path one = recordings.new_recording();
  fs::create_directory(one);
  EXPECT_NE(recordings.new_recording(), one);
}

TEST_F(RecordingsFolderTest, FreeBytesOfAFolderThatIsNotMadeYet) {
  EXPECT_GT(RecordingsFolder::disk_free_bytes(at("not") / "made"), 0u);
}

}  // namespace
}  // namespace lumigraft::server
