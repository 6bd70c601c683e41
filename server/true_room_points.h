#pragma once
// Points all over the true real surfaces of a session, seen by its camera or not.
#include <filesystem>
#include <vector>

#include "reconstruct/enclosure.h"

namespace lumigraft {

/// Of truth/real_scene.ply, each for about the same area, in a fixed order. Throws InputError.
std::vector<RoomPoint> true_room_points(const std::filesystem::path& real_scene_ply);

}  // namespace lumigraft
