#pragma once
// --set KEY=VALUE over a TOML document, and the words that configuration errors are made of. Only config.cpp includes
// this.
#include <toml++/toml.h>

#include <set>
#include <string>
#include <string_view>

namespace lumigraft::capture::config_detail {

/// A string of the input inside quotes, kept on one line and short.
std::string in_quotes(std::string_view text);
std::string number_text(double value);
/// "found ..." for any value, or for none.
std::string found_text(const toml::node* node);
/// "color" and "width" to "color.width".
std::string join(const std::string& path, std::string_view key);

/// Lays one KEY=VALUE over the document; the value is TOML where it parses as such, else a bare string. Tables on the
/// way are made where there are none. What it gave is added to `overridden`. Throws InputError.
void apply_override(toml::table& root, const std::string& line, std::set<std::string>& overridden);
/// Whether a dotted key, or a table it lies in, was given by an override.
bool was_overridden(const std::set<std::string>& overridden, const std::string& path);

}  // namespace lumigraft::capture::config_detail
