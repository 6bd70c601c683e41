#pragma once
// Edits the text of an exhibit.toml; what is not concerned stays as somebody wrote it.
#include <string>

namespace lumigraft::server {

/// Without the [[object]] tables that show this model, with their sub-tables and their comments; the same text if there
/// is none. `model`: as the key says it. Throws InputError where the text is no TOML.
std::string without_objects_of(const std::string& exhibit_text, const std::string& model);

}  // namespace lumigraft::server
