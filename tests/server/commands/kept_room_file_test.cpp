#include "server/commands/kept_room_file.h"

#include <gtest/gtest.h>

#include <fstream>

#include "tests/server/tiny_session.h"

namespace lumigraft::server {
namespace {

namespace fs = std::filesystem;

reconstruct::RoomToKeep one_brick() {
  auto brick = std::make_shared<reconstruct::FieldBrick>();
  brick->weight.fill(1);
  reconstruct::RoomToKeep found;
  found.room.field.bricks[{1, 2, 3}] = brick;
  return found;
}

TEST(KeptRoomFileTest, SurvivesARestartAndKeepsWhatItCannotUse) {
  const TinySession folder("room");
  const fs::path file = default_kept_room(folder.folder / "kiosk.toml");
  EXPECT_EQ(file, folder.folder / "kiosk.room");
  const capture::Tag tag{"tag36h11", 2, 0.16};
  KeptRoomFile first(file, tag, {});
  EXPECT_EQ(first.message(), "");
  EXPECT_FALSE(first.take());
  EXPECT_EQ(first.save(one_brick()), "");
  EXPECT_EQ(first.size(), fs::file_size(file));
  KeptRoomFile second(file, tag, {});
  EXPECT_EQ(second.message(), file.string() +
                                  ": the room with 1 bricks of surface, as kept before, is used as soon as "
                                  "the camera sees that it is this one");
  EXPECT_EQ(second.size(), fs::file_size(file));
  const auto room = second.take();
  ASSERT_TRUE(room);
  EXPECT_TRUE(room->field.brick({1, 2, 3}));
  EXPECT_FALSE(second.take());

  capture::Tag other = tag;
  other.id = 3;
  KeptRoomFile refused(file, other, {});
  EXPECT_FALSE(refused.take());
  EXPECT_EQ(refused.message(), file.string() +
                                   ": world: found \"tag36h11 2, 0.16 m\", allowed: \"tag36h11 3, 0.16 m\"; this room "
                                   "is not used, and kept as " +
                                   file.string() + ".unused when another one is");
  EXPECT_EQ(refused.save(one_brick()), "");
  EXPECT_EQ(refused.save(one_brick()), "");
  EXPECT_TRUE(fs::exists(file.string() + ".unused")) << "the other room";
  EXPECT_FALSE(fs::exists(file.string() + ".unused2")) << "this one is replaced";
  EXPECT_TRUE(KeptRoomFile(file, other, {}).take());
}

TEST(KeptRoomFileTest, ARoomThatTheCameraDoesNotSeeIsKeptToo) {
  const TinySession folder("room-another");
  const fs::path file = folder.folder / "kiosk.room";
  EXPECT_EQ(KeptRoomFile(file, {}, {}).save(one_brick()), "");
  const std::uintmax_t size = fs::file_size(file);
  KeptRoomFile second(file, {}, {});
  ASSERT_TRUE(second.take());
  reconstruct::RoomToKeep found = one_brick();
  found.room.field.bricks[{4, 5, 6}] = found.room.field.bricks.begin()->second;
  found.another = true;
  EXPECT_EQ(second.save(found), "");
  EXPECT_EQ(second.save(found), "");
  EXPECT_EQ(fs::file_size(file.string() + ".unused"), size);
  EXPECT_FALSE(fs::exists(file.string() + ".unused2"));
  EXPECT_EQ(KeptRoomFile(file, {}, {}).take()->field.bricks.size(), 2u);
}

TEST(KeptRoomFileTest, AFailedSaveIsReportedOnce) {
  const TinySession folder("room-absent");
  KeptRoomFile room(folder.folder / "absent" / "kiosk.room", {}, {});
  EXPECT_NE(room.save(one_brick()).find("the room cannot be kept: "), std::string::npos);
  EXPECT_EQ(room.save(one_brick()), "");
}

}  // namespace
}  // namespace lumigraft::server
