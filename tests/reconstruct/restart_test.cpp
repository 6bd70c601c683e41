// A scene builder that goes on from the room that an earlier one kept.
#include <gtest/gtest.h>

#include <algorithm>

#include "capture/source.h"
#include "reconstruct/scene_builder.h"
#include "tests/reconstruct/kept_room/kept_test_room.h"

namespace lumigraft::reconstruct {
namespace {

capture::Session kept_session() {
  return capture::read_session(capture::ConfigTable::load(LUMIGRAFT_SOURCE_DIR "/recordings/tabletop/session.toml"));
}

std::vector<capture::FrameSet> some_frames(const capture::Session& session, std::size_t count) {
  const std::unique_ptr<capture::FrameReader> reader = capture::open_paired_frames(session);
  std::vector<capture::FrameSet> frames;
  while (frames.size() < count) frames.push_back(reader->next(std::chrono::seconds(10)).value());
  return frames;
}

std::vector<std::string> about_the_room(const std::vector<std::string>& warnings) {
  std::vector<std::string> result;
  for (const std::string& warning : warnings)
    if (warning.find("the room that was kept") != std::string::npos) result.push_back(warning);
  return result;
}

/// The room as kept after some frames.
KeptRoom room_of_earlier_run(const capture::Session& session, const std::vector<capture::FrameSet>& frames) {
  SceneBuilder builder(session);
  EXPECT_FALSE(builder.room_to_keep()) << "nothing is known yet";
  for (const capture::FrameSet& frame : frames) builder.build(frame);
  const std::optional<RoomToKeep> found = builder.room_to_keep();
  EXPECT_FALSE(builder.room_to_keep()) << "as before";
  EXPECT_FALSE(found->another);
  EXPECT_TRUE(found->room.albedo);
  EXPECT_GT(found->room.albedo_error, 0);
  EXPECT_FALSE(found->room.lamps.empty());
  const RoomFolder folder("restart");
  write_room(folder.file(), found->room, session.tag);
  return read_room(folder.file(), session.tag, {});
}

/// Elsewhere, as if the tag had been moved.
KeptRoom moved(const KeptRoom& room) {
  KeptRoom result;
  result.field = room.field;
  result.field.bricks.clear();
  for (const auto& [key, brick] : room.field.bricks) result.field.bricks[{key[0] + 5, key[1], key[2] + 4}] = brick;
  return result;
}

TEST(Restart, KnowsTheRoomFromItsFirstFrame) {
  const capture::Session session = kept_session();
  const std::vector<capture::FrameSet> frames = some_frames(session, 8);
  KeptRoom kept = room_of_earlier_run(session, frames);
  // Surface that this run does not see.
  const BrickKey unseen{200, 200, 200};
  kept.field.bricks[unseen] = kept.field.bricks.begin()->second;
  auto albedo = std::make_shared<AlbedoField>(*kept.albedo);
  albedo->bricks[unseen] = kept.albedo->bricks.begin()->second;
  kept.albedo = albedo;
  const std::size_t bricks = kept.field.bricks.size();
  KeptLamp dark = kept.lamps.at(0);  // one that does not shine in this run
  dark.position_m = {0, 0, 2.5f};
  kept.lamps.push_back(dark);
  const std::size_t lamps = kept.lamps.size();

  SceneBuilder cold(session), warm(session);
  warm.restore_room(std::move(kept));
  cold.build(frames[0]);
  const BuildResult first = warm.build(frames[0]);
  EXPECT_TRUE(about_the_room(first.warnings).empty());
  ASSERT_TRUE(first.scene.field && first.scene.albedo);
  EXPECT_GE(first.scene.field->bricks.size(), bricks);
  EXPECT_TRUE(first.scene.field->brick(unseen));
  EXPECT_TRUE(first.scene.albedo->bricks.contains(unseen));
  const std::optional<RoomToKeep> unknown = cold.room_to_keep();
  ASSERT_TRUE(unknown);
  EXPECT_FALSE(unknown->room.field.brick(unseen));
  const std::optional<RoomToKeep> again = warm.room_to_keep();
  ASSERT_TRUE(again);
  EXPECT_FALSE(again->another);
  EXPECT_TRUE(again->room.field.brick(unseen)) << "for the start after this one";
  EXPECT_TRUE(again->room.albedo->bricks.contains(unseen));
  ASSERT_EQ(again->room.lamps.size(), lamps) << "those that were seen again, once, and the dark one";
  EXPECT_EQ(again->room.lamps.back().position_m, dark.position_m);
}

TEST(Restart, HasAlbedoBeforeItIsSolved) {
  const capture::Session session = kept_session();
  const std::vector<capture::FrameSet> frames = some_frames(session, 2);
  SceneBuilder builder(session);
  builder.restore_room(room_of_earlier_run(session, frames));
  const capture::FrameSet frame = builder.register_depth(frames[0]);
  const std::optional<Pose> pose = builder.locate_camera(frame).pose;
  ASSERT_TRUE(pose);
  builder.fuse_depth(frame, *pose);
  EXPECT_FALSE(builder.solve_albedo()) << "there is no light yet";
  const Scene scene = builder.store().newest();
  ASSERT_TRUE(scene.field && scene.albedo);
  std::size_t known = 0;
  for (const auto& [key, brick] : scene.albedo->bricks) known += scene.field->brick(key) ? 1 : 0;
  EXPECT_GT(known, 1000u);
  const std::optional<RoomToKeep> again = builder.room_to_keep();
  ASSERT_TRUE(again);
  EXPECT_FALSE(again->room.lamps.empty()) << "nothing that was kept is lost before it is learnt again";
}

TEST(Restart, InAnotherRoomBeginsAnew) {
  const capture::Session session = kept_session();
  const std::vector<capture::FrameSet> frames = some_frames(session, 2);
  SceneBuilder cold(session), builder(session);
  builder.restore_room(moved(room_of_earlier_run(session, frames)));
  const std::size_t bricks = cold.build(frames[0]).scene.field->bricks.size();
  capture::FrameSet frame = frames[0];
  std::vector<std::string> warnings;
  int looks = 0;
  for (; looks < 100 && warnings.empty(); ++looks) {
    EXPECT_FALSE(builder.room_to_keep()) << "its file may still be of this room";
    warnings = about_the_room(builder.build(frame).warnings);
    frame.time_ns += 600'000'000;
  }
  EXPECT_GE(looks, 10) << "a visitor may have been in front of the camera";
  ASSERT_EQ(warnings.size(), 1u);
  EXPECT_NE(warnings[0].find("allowed: more than half"), std::string::npos) << warnings[0];
  EXPECT_NEAR(static_cast<double>(builder.store().newest().field->bricks.size()), static_cast<double>(bricks),
              0.1 * static_cast<double>(bricks));
  const std::optional<RoomToKeep> found = builder.room_to_keep();
  ASSERT_TRUE(found);
  EXPECT_TRUE(found->another);
  EXPECT_TRUE(about_the_room(builder.store().newest().warnings).empty()) << "it is replaced";
}

}  // namespace
}  // namespace lumigraft::reconstruct
