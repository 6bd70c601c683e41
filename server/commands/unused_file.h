#pragma once
#include <filesystem>

namespace lumigraft::server {

/// Keeps a file that cannot be used: renames it to FILE.unused, or the first of FILE.unused2, FILE.unused3 ... that
/// does not exist.
void keep_as_unused(const std::filesystem::path& file);

}  // namespace lumigraft::server
