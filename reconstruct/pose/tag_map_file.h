#pragma once
// What was learnt about the places of tags, as a TOML file, so that it survives a restart.
#include <filesystem>
#include <string>

#include "capture/session/session.h"
#include "reconstruct/pose/tag_map.h"

namespace lumigraft::reconstruct {

/// The text of the file. Metres and radians; poses in the first tag's original place.
std::string tag_map_text(const capture::Tag& tag, const TagMap::State& state);

/// Reads what tag_map_text wrote for the same tags; tags that were configured since are not located yet. Throws
/// InputError for a file of another version, that is incomplete or damaged, or of other tags: other numbers, sizes or
/// configured poses.
TagMap::State read_tag_map(const std::filesystem::path& file, const capture::Tag& tag);

}  // namespace lumigraft::reconstruct
