#include "capture/session/session_text.h"

#include <set>
#include <sstream>

#include "capture/error.h"
#include "capture/session/config_override.h"

namespace lumigraft::capture {

std::string text_with_overrides(const SessionText& text) {
  try {
    toml::table root = toml::parse_file(text.file.string());
    std::set<std::string> overridden;
    for (const std::string& line : text.overrides) config_detail::apply_override(root, line, overridden);
    std::ostringstream out;
    out << toml::toml_formatter(root, toml::toml_formatter::default_flags & ~toml::format_flags::indentation) << '\n';
    return out.str();
  } catch (const toml::parse_error& e) {
    throw InputError(text.file.string() + ": " + std::string(e.description()));
  }
}

}  // namespace lumigraft::capture
