#pragma once
// Writes text files, and makes folders for what a command writes.
#include <filesystem>
#include <string>

namespace lumigraft::capture {

/// Atomic: replaces an earlier file of this name, or leaves it as it was and throws std::runtime_error.
void write_text(const std::filesystem::path& file, const std::string& text);

/// Makes the folder of `--out`. Throws InputError unless it is new or empty.
void make_out_folder(const std::filesystem::path& folder);

}  // namespace lumigraft::capture
