#include "capture/session/config_override.h"

#include <algorithm>
#include <sstream>
#include <vector>

#include "capture/error.h"

namespace lumigraft::capture::config_detail {

std::string in_quotes(std::string_view text) {
  constexpr std::size_t kLongest = 80;
  std::string out = "\"";
  for (const char c : text.substr(0, kLongest)) {
    if (c == '\n') {
      out += "\\n";
    } else if (c == '"' || c == '\\') {
      out += {'\\', c};
    } else {
      out += static_cast<unsigned char>(c) < 0x20 || c == 0x7f ? '?' : c;
    }
  }
  return out + (text.size() > kLongest ? "...\"" : "\"");
}

std::string number_text(double value) {
  std::ostringstream out;
  out.precision(12);
  out << value;
  return out.str();
}

std::string found_text(const toml::node* node) {
  if (node == nullptr) return "found nothing";
  if (const auto* s = node->as_string()) return "found " + in_quotes(s->get());
  if (const auto* i = node->as_integer()) return "found " + std::to_string(i->get());
  if (const auto* d = node->as_floating_point()) return "found " + number_text(d->get());
  if (const auto* b = node->as_boolean()) return b->get() ? "found true" : "found false";
  if (const auto* a = node->as_array()) return "found an array of " + std::to_string(a->size());
  return node->is_table() ? "found a table" : "found a date or time";
}

std::string join(const std::string& path, std::string_view key) {
  return path.empty() ? std::string(key) : path + "." + std::string(key);
}

namespace {

std::vector<std::string> split_key(const std::string& key) {
  std::vector<std::string> parts;
  std::stringstream in(key);
  for (std::string part; std::getline(in, part, '.');) parts.push_back(part);
  const bool empty_part = std::any_of(parts.begin(), parts.end(), [](const std::string& p) { return p.empty(); });
  refuse_if(parts.empty() || empty_part || key.back() == '.',
            "--set " + in_quotes(key) + ": found an empty key, allowed: KEY=VALUE with a dotted key");
  return parts;
}

/// The value of an override: TOML if it parses as TOML, else the bare text ("images:color.txt").
toml::table override_value(const std::string& value) {
  if (value.find('\n') == std::string::npos) {
    try {
      return toml::parse("value = " + value);
    } catch (const toml::parse_error&) {
      // Not TOML: a bare string.
    }
  }
  return toml::table{{"value", value}};
}

/// The element that `part` names in a table or an array of tables; creates a missing table.
toml::node* descend(toml::node* at, const std::string& part, const std::string& key) {
  if (auto* table = at->as_table()) {
    if (!table->contains(part)) table->insert(part, toml::table{});
    return table->get(part);
  }
  if (auto* array = at->as_array()) {
    const bool digits = part.find_first_not_of("0123456789") == std::string::npos && part.size() < 6;
    if (digits && std::stoul(part) < array->size()) return array->get(std::stoul(part));
    throw InputError("--set " + key + ": found no element \"" + part + "\", allowed: an index below " +
                     std::to_string(array->size()));
  }
  throw InputError("--set " + key + ": " + found_text(at) + " on the way to \"" + part + "\", allowed: a table");
}

}  // namespace

void apply_override(toml::table& root, const std::string& line, std::set<std::string>& overridden) {
  const std::size_t equals = line.find('=');
  refuse_if(equals == std::string::npos, "--set " + in_quotes(line) + ": found no '=', allowed: KEY=VALUE");
  const std::string key = line.substr(0, equals);
  const std::vector<std::string> parts = split_key(key);
  toml::node* at = &root;
  std::string path;
  for (std::size_t i = 0; i + 1 < parts.size(); ++i) {
    path = join(path, parts[i]);
    if (at->is_table() && !at->as_table()->contains(parts[i])) overridden.insert(path);
    at = descend(at, parts[i], key);
  }
  toml::table* table = at->as_table();
  refuse_if(table == nullptr,
            "--set " + key + ": " + found_text(at) + " in place of a table, allowed: a key of a table");
  const toml::table value = override_value(line.substr(equals + 1));
  table->insert_or_assign(parts.back(), *value.get("value"));
  overridden.insert(key);
}

bool was_overridden(const std::set<std::string>& overridden, const std::string& path) {
  for (std::size_t end = path.find('.');; end = path.find('.', end + 1)) {
    if (overridden.count(path.substr(0, end)) != 0) return true;
    if (end == std::string::npos) return false;
  }
}

}  // namespace lumigraft::capture::config_detail
