#pragma once
// A small room to keep, and a folder for its file.
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <iterator>
#include <memory>
#include <string>
#include <vector>

#include "reconstruct/kept_room/room_file.h"
#include "tests/reconstruct/albedo/albedo_room.h"

namespace lumigraft::reconstruct {

/// A floor with a box, seen on one side only, with a coarse field and albedo.
inline KeptRoom room_to_write() {
  TestRoom shape;
  shape.half_m = 0.12f;
  shape.boxes = {{{0.05f, -0.05f, 0}, {0.12f, 0.05f, 0.06f}}};
  shape.seen = [](const Eigen::Vector3f& p) { return p.x() < 0.1f; };
  KeptRoom room;
  room.field = shape.field();
  for (const BrickKey& key : sorted_keys(room.field.bricks)) {
    auto brick = std::make_shared<FieldBrick>(*room.field.bricks.at(key));
    for (std::size_t i = 0; i < kBrickVoxels; ++i) brick->weight[i] *= 0.37f * static_cast<float>(1 + i % 170);
    room.field.bricks[key] = brick;
  }
  DistanceField coarse;
  coarse.voxel_m = 6 * room.field.voxel_m;
  coarse.truncation_m = 6 * room.field.truncation_m;
  coarse.bricks[{10, -3, 1}] = room.field.bricks.begin()->second;
  room.field.coarse = std::make_shared<const DistanceField>(coarse);
  auto albedo = std::make_shared<AlbedoField>();
  for (const auto& [key, field] : room.field.bricks) {
    auto brick = std::make_shared<AlbedoBrick>();
    for (std::size_t i = 0; i < kBrickVoxels; ++i) {
      brick->albedo[i] = {0.02f, 0.3f + 0.001f * static_cast<float>(i), 0.9f};
      brick->sigma[i] = field->weight[i] > 0 ? 0.05f : -1;
    }
    albedo->bricks[key] = brick;
  }
  room.albedo = albedo;
  room.albedo_error = 0.02f;
  room.lamps = {{{0.4f, -0.2f, 1.7f}, 0.05f, 0.03f, false, false}, {{1, 2, 2.5f}, 0.3f, 0.1f, true, true}};
  return room;
}

inline capture::Tag test_tag() {
  capture::Tag tag;
  tag.family = "tag36h11";
  tag.id = 4;
  tag.size_m = 0.16;
  return tag;
}

class RoomFolder {
 public:
  explicit RoomFolder(const std::string& name)
      : folder_(std::filesystem::path(testing::TempDir()) /
                ("lumigraft-room-" + name + "-" + std::to_string(getpid()))) {
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
  }
  ~RoomFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(folder_, ignored);
  }
  RoomFolder(const RoomFolder&) = delete;
  RoomFolder& operator=(const RoomFolder&) = delete;

  std::filesystem::path file() const { return folder_ / "kiosk.room"; }
  std::vector<std::uint8_t> bytes() const {
    std::ifstream in(file(), std::ios::binary);
    return {std::istreambuf_iterator<char>(in), {}};
  }
  void write(const std::vector<std::uint8_t>& bytes) const {
    std::ofstream out(file(), std::ios::binary);
    out.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  }

 private:
  std::filesystem::path folder_;
};

}  // namespace lumigraft::reconstruct
