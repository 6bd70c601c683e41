#pragma once
// What an operator saved of an exhibit: a file of its own beside that of the exhibit, whose text and comments stay as
// they were written. It has an [[object]] for each, in order; of objects with the same name, the first means the first.
// What it says replaces what the exhibit says: place and attitude (and then its key frames), visibility, material,
// variant and animation.
#include <filesystem>
#include <string>
#include <vector>

#include "relight/exhibit/exhibit.h"

namespace lumigraft::server {

/// EXHIBIT.saved.toml of EXHIBIT.toml.
std::filesystem::path saved_exhibit_file(const std::filesystem::path& exhibit);

/// The text of such a file. Animations are as of time 0.
std::string saved_exhibit_text(const relight::Exhibit& exhibit);

/// The exhibit's text with what was saved. Adds a warning for each object that was saved and is not there any more.
/// Throws InputError where one of the files is no TOML.
std::string exhibit_text_with_saved(const std::filesystem::path& exhibit, const std::filesystem::path& saved,
                                    std::vector<std::string>& warnings);

}  // namespace lumigraft::server
