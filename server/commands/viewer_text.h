#pragma once
// Texts for viewers.
#include <string>

namespace lumigraft::server {

/// The text with the last names of absolute paths in their place: viewers need not know where this machine keeps files.
std::string without_folders(const std::string& text);

}  // namespace lumigraft::server
