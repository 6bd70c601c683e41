#pragma once
#include <filesystem>

namespace lumigraft::server {

/// Keeps a file that cannot be used: renames it to FILE.unused, and those that were kept before to FILE.unused2,
/// FILE.unused3 ... Of more than CommandParameters::max_unused the oldest is deleted.
void keep_as_unused(const std::filesystem::path& file);

}  // namespace lumigraft::server
