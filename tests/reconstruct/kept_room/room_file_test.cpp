#include "reconstruct/kept_room/room_file.h"

#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

#include "reconstruct/albedo/kept_albedo.h"
#include "reconstruct/kept_room/parameters.h"
#include "tests/reconstruct/kept_room/kept_test_room.h"

namespace lumigraft::reconstruct {
namespace {

constexpr float kRounding = 1e-6f;  // of float arithmetic
constexpr float kHalf = 0.5f;       // of a step: what storage may change

void expect_near(const DistanceField& read, const DistanceField& written) {
  EXPECT_FLOAT_EQ(read.voxel_m, written.voxel_m);
  EXPECT_FLOAT_EQ(read.truncation_m, written.truncation_m);
  ASSERT_EQ(sorted_keys(read.bricks), sorted_keys(written.bricks));
  const float step_m = written.truncation_m / static_cast<float>(kKeptRoom.file.distance_steps);
  for (const auto& [key, brick] : written.bricks) {
    const FieldBrick& other = *read.bricks.at(key);
    ASSERT_FALSE(other.color) << "light of then is not light of now";
    for (std::size_t i = 0; i < kBrickVoxels; ++i) {
      ASSERT_NEAR(other.distance_m[i], brick->distance_m[i], kHalf * step_m + kRounding);
      ASSERT_NEAR(other.weight[i], brick->weight[i], 0.004f * brick->weight[i]);
      ASSERT_EQ(other.weight[i] > 0, brick->weight[i] > 0) << "unknown stays unknown";
    }
  }
}

TEST(RoomFile, GivesSurfacesAndAlbedoBack) {
  const RoomFolder folder("again");
  const KeptRoom written = room_to_write();
  const std::uintmax_t size = write_room(folder.file(), written, test_tag());
  EXPECT_EQ(size, folder.bytes().size());
  EXPECT_FALSE(std::filesystem::exists(folder.file().string() + ".partial"));
  const KeptRoom read = read_room(folder.file(), test_tag(), {});
  expect_near(read.field, written.field);
  ASSERT_TRUE(read.field.coarse);
  expect_near(*read.field.coarse, *written.field.coarse);
  ASSERT_TRUE(read.albedo);
  ASSERT_EQ(sorted_keys(read.albedo->bricks), sorted_keys(written.albedo->bricks));
  const float step = 1 / static_cast<float>(kKeptRoom.file.albedo_steps);
  for (const auto& [key, brick] : written.albedo->bricks)
    for (std::size_t i = 0; i < kBrickVoxels; ++i) {
      const AlbedoBrick& other = *read.albedo->bricks.at(key);
      if (brick->sigma[i] < 0) {
        ASSERT_LT(other.sigma[i], 0);
        continue;
      }
      ASSERT_LE((other.albedo[i] - brick->albedo[i]).cwiseAbs().maxCoeff(), kHalf * step + kRounding);
      const float sigma = sigma_later({brick->albedo[i], brick->sigma[i]}, written.albedo_error);
      ASSERT_NEAR(other.sigma[i], sigma, kHalf * step + kRounding);
    }
}

TEST(RoomFile, GivesLampsBack) {
  const RoomFolder folder("lamps");
  const KeptRoom written = room_to_write();
  write_room(folder.file(), written, test_tag());
  const KeptRoom read = read_room(folder.file(), test_tag(), {});
  ASSERT_EQ(read.lamps.size(), written.lamps.size());
  for (std::size_t i = 0; i < read.lamps.size(); ++i) {
    EXPECT_EQ(read.lamps[i].position_m, written.lamps[i].position_m);
    EXPECT_EQ(read.lamps[i].radius_m, written.lamps[i].radius_m);
    EXPECT_EQ(read.lamps[i].distance_log_sigma, written.lamps[i].distance_log_sigma);
    EXPECT_EQ(read.lamps[i].flat, written.lamps[i].flat);
    EXPECT_EQ(read.lamps[i].beam, written.lamps[i].beam);
  }
}

// So that what was kept for months does not drift from one start to the next.
TEST(RoomFile, IsTheSameWhenItIsWrittenAgain) {
  const RoomFolder folder("twice");
  KeptRoom room = room_to_write();
  room.albedo = nullptr;  // its sigma grows with every start
  write_room(folder.file(), room, test_tag());
  const std::vector<std::uint8_t> first = folder.bytes();
  write_room(folder.file(), read_room(folder.file(), test_tag(), {}), test_tag());
  EXPECT_EQ(folder.bytes(), first);
}

TEST(RoomFile, GuessesAreNotKept) {
  const RoomFolder folder("guess");
  KeptRoom room = room_to_write();
  room.albedo_error = 2;
  write_room(folder.file(), room, test_tag());
  const KeptRoom read = read_room(folder.file(), test_tag(), {});
  ASSERT_TRUE(read.albedo);
  for (const auto& [key, brick] : read.albedo->bricks)
    for (const float sigma : brick->sigma) ASSERT_LT(sigma, 0);
}

TEST(RoomFile, WithoutASurfaceItsAlbedoIsNotKept) {
  const RoomFolder folder("evicted");
  KeptRoom room = room_to_write();
  const BrickKey gone = room.field.bricks.begin()->first;
  room.field.bricks.erase(gone);
  write_room(folder.file(), room, test_tag());
  const KeptRoom read = read_room(folder.file(), test_tag(), {});
  EXPECT_FALSE(read.albedo->bricks.contains(gone));
  EXPECT_EQ(read.albedo->bricks.size(), room.field.bricks.size());
}

TEST(RoomFile, OfALargeRoomWhatIsNearTheTagIsRead) {
  const RoomFolder folder("large");
  const KeptRoom room = room_to_write();
  write_room(folder.file(), room, test_tag());
  FusionSettings small;
  small.max_memory_mb = 1e-6 * static_cast<double>(20.5 * sizeof(FieldBrick));
  const KeptRoom read = read_room(folder.file(), test_tag(), small);
  ASSERT_EQ(read.field.bricks.size(), 20u);
  const auto squared = [](const BrickKey& k) { return k[0] * k[0] + k[1] * k[1] + k[2] * k[2]; };
  int farthest = 0;
  for (const auto& [key, brick] : read.field.bricks) farthest = std::max(farthest, squared(key));
  for (const auto& [key, brick] : room.field.bricks) {
    EXPECT_TRUE(read.field.bricks.contains(key) || squared(key) >= farthest);
  }
}

TEST(RoomFile, AFailedWriteLeavesTheOlderFile) {
  const RoomFolder folder("failed");
  write_room(folder.file(), room_to_write(), test_tag());
  const std::vector<std::uint8_t> before = folder.bytes();
  std::filesystem::create_directories(folder.file().string() + ".partial");  // no file can be made there
  EXPECT_THROW(write_room(folder.file(), room_to_write(), test_tag()), std::runtime_error);
  EXPECT_EQ(folder.bytes(), before);
  EXPECT_THROW(write_room(folder.file().parent_path() / "absent" / "room", room_to_write(), test_tag()),
               std::runtime_error);
}

}  // namespace
}  // namespace lumigraft::reconstruct
