#include "server/commands/exhibit_text.h"

#include <toml++/toml.h>

#include <algorithm>
#include <cstddef>
#include <sstream>
#include <utility>
#include <vector>

#include "capture/error.h"
#include "capture/message_text.h"

namespace lumigraft::server {
namespace {

/// First lines of all tables of this one's own and deeper ones, from 1.
void add_first_lines(const toml::node& node, std::vector<std::size_t>& lines) {
  if (const toml::table* const table = node.as_table()) {
    if (!table->is_inline() && table->source().begin) lines.push_back(table->source().begin.line);
    for (const auto& [key, value] : *table) add_first_lines(value, lines);
  } else if (const toml::array* const array = node.as_array()) {
    for (const toml::node& value : *array) add_first_lines(value, lines);
  }
}

bool is_blank_or_comment(const std::string& line) {
  const std::size_t begin = line.find_first_not_of(" \t\r");
  return begin == std::string::npos || line[begin] == '#';
}

std::vector<std::string> lines_of(const std::string& text) {
  std::istringstream in(text);
  std::vector<std::string> lines;
  for (std::string line; std::getline(in, line);) lines.push_back(line);
  return lines;
}

}  // namespace

std::string without_objects_of(const std::string& exhibit_text, const std::string& model) {
  toml::table root;
  try {
    root = toml::parse(exhibit_text);
  } catch (const toml::parse_error& e) {
    throw capture::InputError("found a TOML error: " + capture::on_one_line(std::string(e.description())));
  }
  std::vector<std::size_t> removed, others;  // first lines of tables
  for (const auto& [key, value] : root) {
    const toml::array* const objects = key == "object" ? value.as_array() : nullptr;
    if (objects == nullptr) {
      add_first_lines(value, others);
      continue;
    }
    for (const toml::node& node : *objects) {
      const toml::table* const object = node.as_table();
      const bool shows = object != nullptr && (*object)["model"].value_or(std::string()) == model;
      add_first_lines(node, shows ? removed : others);
    }
  }
  if (removed.empty()) return exhibit_text;
  const auto starts = [](const std::vector<std::size_t>& all, std::size_t line) {
    return std::ranges::find(all, line) != all.end();
  };
  const std::vector<std::string> lines = lines_of(exhibit_text);
  std::vector<std::string> kept, undecided;  // of a removed table's end: comments of the next one, maybe
  bool removing = false;
  for (std::size_t i = 0; i < lines.size(); ++i) {
    if (starts(removed, i + 1)) {
      if (!removing)
        while (!kept.empty() && kept.back().empty()) kept.pop_back();  // as many blank lines as the text had before it
      removing = true;
      undecided.clear();
    } else if (starts(others, i + 1)) {
      if (removing) kept.insert(kept.end(), undecided.begin(), undecided.end());
      removing = false;
    }
    if (!removing) {
      kept.push_back(lines[i]);
    } else if (is_blank_or_comment(lines[i])) {
      undecided.push_back(lines[i]);
    } else {
      undecided.clear();
    }
  }
  std::string text;
  for (const std::string& line : kept) text += line + '\n';
  return text;
}

}  // namespace lumigraft::server
