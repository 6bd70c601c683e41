#pragma once
// Whether this user may use device nodes and folders, and what would allow it.
#include <filesystem>
#include <string>

namespace lumigraft::server {

/// "NAME, groups video render".
std::string user_text();

/// Whether this user may read and write a file that exists.
bool may_use(const std::filesystem::path& file);

/// What allows a device node to a user who may not use it: to join its group where that may, else a rule of udev.
std::string mend_node(const std::filesystem::path& node);

/// A folder, or the nearest above it that exists.
std::filesystem::path existing_part(std::filesystem::path folder);

/// Why this user cannot write into a folder that exists or is still to be made; empty if he can.
std::string unwritable(const std::filesystem::path& folder);

/// What allows it.
std::string mend_folder(const std::filesystem::path& folder);

}  // namespace lumigraft::server
