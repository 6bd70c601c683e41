#pragma once
// Kept views of a room as a file, so that the camera is found again after a restart.
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "capture/camera/camera_model.h"
#include "capture/session/session.h"
#include "reconstruct/pose/keyframe_map.h"

namespace lumigraft::reconstruct {

/// What the world frame belongs to: the tag with its size, or a surface.
std::string world_name(const capture::Tag& tag);

/// Writes OpenCV's YAML, compressed if the name ends in .gz, in one step: an older file stays until the new one is
/// whole. About 30 kB a view. Throws InputError.
void write_views(const std::filesystem::path& file, const KeyframeMap::Views& views, const capture::Tag& tag,
                 const capture::CameraModel& color);

/// Throws InputError for a file of another version, that is incomplete or damaged, of another camera, or whose world is
/// another one: another tag, or one with a tag for a session without.
KeyframeMap::Views read_views(const std::filesystem::path& file, const capture::Tag& tag,
                              const capture::CameraModel& color);

}  // namespace lumigraft::reconstruct
