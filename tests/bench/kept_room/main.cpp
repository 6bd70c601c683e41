// Reconstructs a room, keeps it in a file and reads it again, and prints what that takes.
//
//   build/release/kept_room SESSION FILE [FRAMES]    the first frames of a session, or all; or all of a folder in the
//                                                    format of 7-Scenes, without light: then no albedo is kept
//   build/release/kept_room compare SESSION ...      fraction of what each one's last frame sees on the surfaces of
//   each
#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <filesystem>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "capture/session/session.h"
#include "capture/source.h"
#include "reconstruct/fusion/fusion.h"
#include "reconstruct/kept_room/room_check.h"
#include "reconstruct/kept_room/room_file.h"
#include "reconstruct/scene_builder.h"
#include "tests/reconstruct/seven_scenes.h"

namespace lumigraft::test {
namespace {

constexpr int kRepetitions = 5;

template <typename Action>
double median_ms(const Action& action) {
  std::vector<double> ms;
  for (int i = 0; i < kRepetitions; ++i) {
    const reconstruct::CostClock clock;
    action();
    ms.push_back(clock.elapsed().wall_ms);
  }
  std::nth_element(ms.begin(), ms.begin() + kRepetitions / 2, ms.end());
  return ms[kRepetitions / 2];
}

struct Known {
  capture::Session session;
  reconstruct::KeptRoom room;
  capture::Image<float> depth_m;  ///< of the last frame
  Eigen::Isometry3d T_tag_camera = Eigen::Isometry3d::Identity();
};

Known known_of_session(const std::filesystem::path& folder, int count) {
  Known known;
  known.session = capture::read_session(capture::ConfigTable::load(folder / "session.toml"));
  reconstruct::SceneBuilder builder(known.session);
  const auto reader = capture::open_paired_frames(known.session);
  for (int i = 0; i < count; ++i) {
    const auto frame = reader->next(std::chrono::seconds(10));
    if (!frame) break;
    const reconstruct::BuildResult built = builder.build(*frame);
    if (!built.frame.depth || !built.scene.pose) continue;
    known.depth_m = built.frame.depth->depth_m;
    known.T_tag_camera = built.scene.pose->T_tag_camera;
  }
  known.room = builder.room_to_keep().value().room;
  return known;
}

Known known_of_capture(const std::filesystem::path& folder) {
  Known known;
  known.session.color.model = seven_scenes_camera();
  reconstruct::FusionStage stage(known.session, {});
  std::optional<Eigen::Isometry3d> T_world_tag;
  std::shared_ptr<const reconstruct::DistanceField> field;
  for (unsigned number = 0, last = 0; number < last + 100; ++number) {
    const auto read = seven_scenes_frame(folder, number);
    if (!read) continue;
    last = number;
    if (!T_world_tag) T_world_tag = read->T_world_camera;
    reconstruct::Pose pose;
    pose.T_tag_camera = pose.T_tag_camera_raw = T_world_tag->inverse() * read->T_world_camera;
    field = stage.fuse(read->frame, pose);
    known.depth_m = read->frame.depth->depth_m;
    known.T_tag_camera = pose.T_tag_camera;
  }
  known.room.field = *field;
  return known;
}

void measure(const std::filesystem::path& folder, const std::filesystem::path& file, int count) {
  const Known known =
      std::filesystem::exists(folder / "session.toml") ? known_of_session(folder, count) : known_of_capture(folder);
  const capture::Tag& tag = known.session.tag;
  std::uintmax_t bytes = 0;
  const double write_ms = median_ms([&] { bytes = reconstruct::write_room(file, known.room, tag); });
  reconstruct::KeptRoom read;
  const double read_ms = median_ms([&] { read = reconstruct::read_room(file, tag, {}); });
  reconstruct::RoomCheck check(known.session.color.model);
  std::int64_t time_ns = 0;
  const double check_ms = median_ms(
      [&] { check.look(read.field, known.depth_m, known.T_tag_camera.cast<float>(), time_ns += 1'000'000'000); });
  const double restore_ms = median_ms([&] {
    reconstruct::FusionStage stage(known.session, {});
    stage.restore(read.field);
  });
  const std::size_t bricks = known.room.field.bricks.size(),
                    coarse = known.room.field.coarse ? known.room.field.coarse->bricks.size() : 0,
                    albedo = known.room.albedo ? known.room.albedo->bricks.size() : 0;
  std::printf("%zu bricks, %zu coarse, %zu of albedo: %.1f MB, %.0f bytes a brick\n", bricks, coarse, albedo,
              1e-6 * static_cast<double>(bytes), static_cast<double>(bytes) / static_cast<double>(bricks + coarse));
  std::printf("ms: write %.0f, read %.0f, compare %.1f (%d of %d points agree), restore %.0f\n", write_ms, read_ms,
              check_ms, check.points().on_surface, check.points().all(), restore_ms);
}

/// A row for each kept room, a column for each room that is seen.
void compare(const std::vector<std::filesystem::path>& folders) {
  std::vector<Known> rooms;
  for (const std::filesystem::path& folder : folders)
    rooms.push_back(known_of_session(folder, std::numeric_limits<int>::max()));
  for (std::size_t kept = 0; kept < rooms.size(); ++kept) {
    for (const Known& seen : rooms) {
      reconstruct::RoomCheck check(seen.session.color.model);
      check.look(rooms[kept].room.field, seen.depth_m, seen.T_tag_camera.cast<float>(), 0);
      std::printf("%4d/%-4d ", check.points().on_surface, check.points().all());
    }
    std::printf(" %s\n", folders[kept].filename().c_str());
  }
}

}  // namespace
}  // namespace lumigraft::test

int main(int count, char** words) {
  const bool compare = count > 2 && std::string(words[1]) == "compare";
  if (!compare && (count < 3 || count > 4)) {
    std::fprintf(stderr, "kept_room SESSION FILE [FRAMES], or kept_room compare SESSION ...\n");
    return 2;
  }
  try {
    if (compare)
      lumigraft::test::compare(std::vector<std::filesystem::path>(words + 2, words + count));
    else
      lumigraft::test::measure(words[1], words[2], count > 3 ? std::atoi(words[3]) : std::numeric_limits<int>::max());
  } catch (const std::exception& e) {
    std::fprintf(stderr, "%s\n", e.what());
    return 2;
  }
}
