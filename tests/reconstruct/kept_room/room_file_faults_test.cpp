// Files that are damaged, cut short, of another version or of another room.
#include <gtest/gtest.h>
#include <zlib.h>

#include <cstring>
#include <random>

#include "capture/error.h"
#include "tests/reconstruct/kept_room/kept_test_room.h"

namespace lumigraft::reconstruct {
namespace {

using FileBytes = std::vector<std::uint8_t>;

std::string room_error(const RoomFolder& folder, const capture::Tag& tag = test_tag(),
                       const FusionSettings& settings = {}) {
  try {
    read_room(folder.file(), tag, settings);
  } catch (const capture::InputError& e) {
    EXPECT_TRUE(std::string(e.what()).starts_with(folder.file().string() + ": ")) << e.what();
    EXPECT_EQ(std::string(e.what()).find('\n'), std::string::npos);
    return std::string(e.what()).substr(folder.file().string().size() + 2);
  }
  return "";
}

std::uint32_t number_at(const FileBytes& bytes, std::size_t at) {
  std::uint32_t value = 0;
  std::memcpy(&value, &bytes[at], sizeof(value));
  return value;
}
void set_number(FileBytes& bytes, std::size_t at, std::uint32_t value) {
  std::memcpy(&bytes[at], &value, sizeof(value));
}

/// Bytes up to the first chunk.
std::size_t head_length(const FileBytes& bytes) { return 16 + number_at(bytes, 12) + 4; }

/// Writes correct checksums over those in the file, as far as its lengths allow.
void repair(FileBytes& bytes) {
  const auto sum = [&](std::size_t from, std::size_t length) {
    return static_cast<std::uint32_t>(crc32_z(0, &bytes[from], length));
  };
  std::size_t at = head_length(bytes);
  if (at + 16 > bytes.size()) return;
  set_number(bytes, at - 4, sum(0, at - 4));
  while (at + 16 <= bytes.size()) {
    const std::size_t length = number_at(bytes, at + 8);
    if (length > bytes.size() - at - 16) return;
    const uLong first = crc32_z(0, &bytes[at], 12);
    set_number(bytes, at + 12, static_cast<std::uint32_t>(crc32_z(first, bytes.data() + at + 16, length)));
    at += 16 + length;
  }
}

class RoomFileFaults : public testing::Test {
 protected:
  RoomFolder folder{"faults"};
  const FileBytes good = [this] {
    write_room(folder.file(), room_to_write(), test_tag());
    return folder.bytes();
  }();

  std::string error_with(const FileBytes& bytes) const {
    folder.write(bytes);
    return room_error(folder);
  }
};

TEST_F(RoomFileFaults, AreNamedWithPlaceFoundAndAllowed) {
  EXPECT_EQ(room_error(folder), "");
  EXPECT_EQ(error_with({}), "found 0 bytes, allowed: 16 at least, it is cut short");
  FileBytes other = good;
  other[0] = 'X';
  EXPECT_EQ(error_with(other), "found another kind of file, allowed: a room that lumigraft kept");
  other = good;
  set_number(other, 8, 1);
  EXPECT_EQ(error_with(other), "format: found 1, allowed: 2");
  other = good;
  other[20] ^= 1;
  EXPECT_TRUE(error_with(other).starts_with("head: found checksum ")) << error_with(other);
  other = good;
  const std::size_t first = head_length(good);
  other[first + 100] ^= 4;
  EXPECT_TRUE(error_with(other).starts_with("field, chunk at byte " + std::to_string(first) + ": found checksum "))
      << error_with(other);
  other = FileBytes(good.begin(), good.end() - 1);
  EXPECT_NE(error_with(other).find("lamps, chunk at byte "), std::string::npos) << error_with(other);
  EXPECT_NE(error_with(other).find("the file is cut short"), std::string::npos) << error_with(other);
  other = good;
  other.push_back(0);
  EXPECT_EQ(error_with(other), "found 1 bytes after the last chunk, allowed: none");
}

TEST_F(RoomFileFaults, RoomsOfOthersAreNamed) {
  capture::Tag tag = test_tag();
  tag.id = 5;
  EXPECT_EQ(room_error(folder, tag), "world: found \"tag36h11 4, 0.16 m\", allowed: \"tag36h11 5, 0.16 m\"");
  tag = test_tag();
  tag.size_m = 0.08;
  EXPECT_EQ(room_error(folder, tag), "world: found \"tag36h11 4, 0.16 m\", allowed: \"tag36h11 4, 0.08 m\"");
  FusionSettings settings;
  settings.voxel_m = 0.01;
  EXPECT_EQ(room_error(folder, test_tag(), settings), "voxel_m: found 0.008, allowed: 0.01");
  settings = {};
  settings.truncation_voxels = 5;
  EXPECT_EQ(room_error(folder, test_tag(), settings), "truncation_m: found 0.032, allowed: 0.04");
}

TEST_F(RoomFileFaults, EveryTruncationIsFound) {
  std::mt19937 random(1);
  for (int i = 0; i < 1000; ++i) {
    const std::size_t length = i < 200 ? static_cast<std::size_t>(i) : random() % good.size();
    ASSERT_NE(error_with(FileBytes(good.begin(), good.begin() + static_cast<std::ptrdiff_t>(length))), "") << length;
  }
}

TEST_F(RoomFileFaults, EveryFlippedBitIsFound) {
  std::mt19937 random(2);
  for (int i = 0; i < 2000; ++i) {
    FileBytes bytes = good;
    const std::size_t at = i < 500 ? static_cast<std::size_t>(i) / 4 : random() % good.size();
    bytes[at] = static_cast<std::uint8_t>(bytes[at] ^ 1u << random() % 8);
    ASSERT_NE(error_with(bytes), "") << at;
  }
}

// A file that was made to have correct checksums. It may be read; it must not end the program.
TEST_F(RoomFileFaults, WithCorrectChecksumsNothingCrashes) {
  std::mt19937 random(3);
  int read = 0, refused = 0;
  for (int i = 0; i < 2000; ++i) {
    FileBytes bytes = good;
    for (int flips = 1 + static_cast<int>(random() % 3); flips > 0; --flips) {
      const std::size_t at = random() % 3 == 0 ? random() % 120 : random() % bytes.size();
      bytes[at] = static_cast<std::uint8_t>(random());
    }
    repair(bytes);
    ++(error_with(bytes).empty() ? read : refused);
  }
  EXPECT_GT(refused, 1000);
  RecordProperty("read", read);
}

TEST_F(RoomFileFaults, NumbersOutOfRangeAreNamed) {
  FileBytes many = good;
  const std::uint64_t bricks = std::uint64_t{1} << 40;
  std::memcpy(&many[32], &bricks, sizeof(bricks));
  repair(many);
  EXPECT_EQ(error_with(many), "field: found 1099511627776 bricks, allowed: 8388608");
  many = good;
  set_number(many, 56, 65);
  repair(many);
  EXPECT_EQ(error_with(many), "lamps: found 65, allowed: 64");
  FileBytes nowhere = good;  // the second lamp's x
  set_number(nowhere, nowhere.size() - 24, 0x7fc00000);
  repair(nowhere);
  EXPECT_NE(error_with(nowhere).find("found lamp 1 with radius 0.3, sigma 0.1 and flags 3, allowed: a finite position"),
            std::string::npos)
      << error_with(nowhere);
  FileBytes kind = good;
  const std::size_t first = head_length(good);
  set_number(kind, first, 2);
  repair(kind);
  EXPECT_TRUE(error_with(kind).find("found kind 2 with ") != std::string::npos) << error_with(kind);
  EXPECT_TRUE(error_with(kind).find("allowed: kind 0 with 1 to ") != std::string::npos) << error_with(kind);
}

}  // namespace
}  // namespace lumigraft::reconstruct
