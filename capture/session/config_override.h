#pragma once
// Applies --set KEY=VALUE to a TOML document; texts of configuration errors. For .cpp files only: it includes toml++.
#include <toml++/toml.h>

#include <set>
#include <string>
#include <string_view>

namespace lumigraft::capture::config_detail {

/// A string of the input in quotes, on one line and at most 80 characters long.
std::string in_quotes(std::string_view text);
std::string number_text(double value);
/// "found ..." for any value; "found nothing" for null.
std::string found_text(const toml::node* node);
/// "color" and "width" to "color.width".
std::string join(const std::string& path, std::string_view key);

/// Applies one KEY=VALUE to the document. The value is TOML if it parses as such, else a bare string. Missing tables
/// are created. Keys that were set are added to `overridden`. Throws InputError.
void apply_override(toml::table& root, const std::string& line, std::set<std::string>& overridden);
/// Whether a dotted key, or a table that contains it, was set by an override.
bool was_overridden(const std::set<std::string>& overridden, const std::string& path);

}  // namespace lumigraft::capture::config_detail
