#include "capture/session/config.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <fstream>
#include <map>
#include <set>
#include <sstream>

#include "capture/error.h"
#include "capture/message_text.h"
#include "capture/session/config_override.h"

namespace lumigraft::capture {

struct ConfigTable::Document {
  std::filesystem::path file;
  toml::table root;
  std::set<std::string> overridden;                 ///< dotted keys that a --set gave
  std::set<std::string, std::less<>> former_names;  ///< former key names that were warned of
  std::vector<std::string> warnings;
};

/// One table of the document and the keys that were read. Shared by every ConfigTable of the same table, so that
/// finish() checks against the keys that any of them read.
struct ConfigTable::Node {
  const toml::table* table = nullptr;
  std::string path;  ///< dotted, with indices for arrays of tables; empty for the root
  int line = 0;
  std::set<std::string, std::less<>> read;     ///< keys whose value was read
  std::set<std::string, std::less<>> allowed;  ///< keys that were read or tested for
  std::map<std::string, std::shared_ptr<Node>, std::less<>> children;

  const toml::node* lookup(std::string_view key) {
    allowed.emplace(key);
    read.emplace(key);
    return table->get(key);
  }

  std::shared_ptr<Node> child(const std::string& name, const toml::node& value) {
    std::shared_ptr<Node>& made = children[name];
    if (made == nullptr) {
      made = std::make_shared<Node>();
      made->table = value.as_table();
      made->path = path.empty() ? name : path + "." + name;
      made->line = value.source().begin ? static_cast<int>(value.source().begin.line) : line;
    }
    return made;
  }
};

namespace {

using config_detail::apply_override;
using config_detail::found_text;
using config_detail::in_quotes;
using config_detail::join;
using config_detail::number_text;
using config_detail::was_overridden;

/// Empty for null, infinity and other types.
std::optional<double> finite_number(const toml::node* node) {
  const auto value = node != nullptr && node->is_number() ? node->value<double>() : std::nullopt;
  return value && std::isfinite(*value) ? value : std::nullopt;
}

std::string range_text(const char* kind, const std::string& low, const std::string& high) {
  return std::string(kind) + " from " + low + " to " + high;
}

}  // namespace

std::string text_with_overrides(const SessionText& text) {
  try {
    toml::table root = toml::parse_file(text.file.string());
    std::set<std::string> overridden;
    for (const std::string& line : text.overrides) apply_override(root, line, overridden);
    std::ostringstream out;
    out << toml::toml_formatter(root, toml::toml_formatter::default_flags & ~toml::format_flags::indentation) << '\n';
    return out.str();
  } catch (const toml::parse_error& e) {
    throw InputError(text.file.string() + ": " + std::string(e.description()));
  }
}

ConfigTable::ConfigTable(std::shared_ptr<Document> document, std::shared_ptr<Node> node)
    : document_(std::move(document)), node_(std::move(node)) {}

ConfigTable ConfigTable::load(const std::filesystem::path& file, const std::vector<std::string>& overrides) {
  std::error_code error;
  std::ifstream in(file, std::ios::binary);
  refuse_if(!in || std::filesystem::is_directory(file, error),
            file.string() + ": found no readable file, allowed: a TOML file");
  std::stringstream text;
  text << in.rdbuf();
  return parse(text.str(), file.string(), overrides);
}

ConfigTable ConfigTable::parse(std::string_view text, const std::string& name,
                               const std::vector<std::string>& overrides) {
  auto document = std::make_shared<Document>();
  document->file = name;
  try {
    document->root = toml::parse(text);
  } catch (const toml::parse_error& e) {
    const std::string line = e.source().begin ? ":" + std::to_string(e.source().begin.line) : "";
    throw InputError(name + line + ": found a TOML error: " + on_one_line(std::string(e.description())));
  }
  for (const std::string& line : overrides) apply_override(document->root, line, document->overridden);
  auto node = std::make_shared<Node>();
  node->table = &document->root;
  return ConfigTable(std::move(document), std::move(node));
}

std::vector<std::string> ConfigTable::keys() const {
  std::vector<std::string> out;
  for (const auto& [key, value] : *node_->table) out.emplace_back(key.str());
  return out;
}

bool ConfigTable::has(std::string_view key) const {
  node_->allowed.emplace(key);
  return node_->table->contains(key);
}

/// Start of a message about a key: "session.toml:7: color.width: ".
std::string ConfigTable::location_of(std::string_view key) const {
  const std::string path = join(node_->path, key);
  if (was_overridden(document_->overridden, path)) return "--set " + path + ": ";
  const toml::node* value = node_->table->get(key);
  const int line =
      value != nullptr && value->source().begin ? static_cast<int>(value->source().begin.line) : node_->line;
  return document_->file.string() + (line > 0 ? ":" + std::to_string(line) : "") + ": " + path + ": ";
}

void ConfigTable::fail(std::string_view key, const std::string& found_and_allowed) const {
  throw InputError(location_of(key) + found_and_allowed);
}

void ConfigTable::warn(std::string_view key, const std::string& text) const {
  document_->warnings.push_back(location_of(key) + text);
}

void ConfigTable::obsolete(std::string_view key) const {
  if (!node_->table->contains(key)) return;
  node_->read.emplace(key);
  warn(key, "has no effect any more");
}

std::string_view ConfigTable::renamed(std::string_view key, std::string_view former) const {
  if (!node_->table->contains(former)) return key;
  if (has(key)) {
    fail(former, "found it together with its new name " + std::string(key) + ", allowed: the new name alone");
  }
  if (document_->former_names.emplace(former).second) warn(former, "is now named " + std::string(key));
  return former;
}

const std::vector<std::string>& ConfigTable::warnings() const { return document_->warnings; }

double ConfigTable::number(std::string_view key, double low, double high) const {
  const toml::node* node = node_->lookup(key);
  const std::optional<double> value = finite_number(node);
  if (!value || *value < low || *value > high) {
    const bool bounded = std::isfinite(low) && std::isfinite(high);
    fail(key,
         found_text(node) + ", allowed: " +
             (bounded ? range_text("a number", number_text(low), number_text(high)) : std::string("a finite number")));
  }
  return *value;
}

double ConfigTable::number(std::string_view key, double low, double high, double fallback) const {
  return has(key) ? number(key, low, high) : fallback;
}

int ConfigTable::integer(std::string_view key, int low, int high) const {
  const toml::node* node = node_->lookup(key);
  const auto* value = node != nullptr ? node->as_integer() : nullptr;
  if (value == nullptr || value->get() < low || value->get() > high) {
    fail(key, found_text(node) + ", allowed: " + range_text("an integer", std::to_string(low), std::to_string(high)));
  }
  return static_cast<int>(value->get());
}

int ConfigTable::integer(std::string_view key, int low, int high, int fallback) const {
  return has(key) ? integer(key, low, high) : fallback;
}

bool ConfigTable::flag(std::string_view key, bool fallback) const {
  if (!has(key)) return fallback;
  const toml::node* node = node_->lookup(key);
  if (!node->is_boolean()) fail(key, found_text(node) + ", allowed: true or false");
  return node->as_boolean()->get();
}

std::string ConfigTable::text(std::string_view key) const {
  const toml::node* node = node_->lookup(key);
  if (node == nullptr || !node->is_string()) fail(key, found_text(node) + ", allowed: a string");
  return node->as_string()->get();
}

std::string ConfigTable::text(std::string_view key, std::string_view fallback) const {
  return has(key) ? text(key) : std::string(fallback);
}

std::string ConfigTable::choice(std::string_view key, const std::vector<std::string>& allowed,
                                std::string_view fallback) const {
  if (!has(key)) return std::string(fallback);
  const toml::node* node = node_->lookup(key);
  std::string words;
  for (const std::string& word : allowed) {
    if (node->is_string() && node->as_string()->get() == word) return word;
    words += (words.empty() ? "" : ", ") + in_quotes(word);
  }
  fail(key, found_text(node) + ", allowed: " + words);
}

std::vector<double> ConfigTable::numbers(std::string_view key, std::size_t count) const {
  return numbers(key, count, count);
}

std::vector<double> ConfigTable::numbers(std::string_view key, std::size_t min_count, std::size_t max_count) const {
  const toml::node* node = node_->lookup(key);
  const std::string counts =
      std::to_string(min_count) + (max_count > min_count ? " to " + std::to_string(max_count) : "");
  const std::string allowed = ", allowed: an array of " + counts + " finite numbers";
  const auto* array = node != nullptr ? node->as_array() : nullptr;
  if (array == nullptr || array->size() < min_count || array->size() > max_count) fail(key, found_text(node) + allowed);
  std::vector<double> out;
  for (const toml::node& element : *array) {
    const std::optional<double> value = finite_number(&element);
    if (!value) fail(key, found_text(&element) + " in the array" + allowed);
    out.push_back(*value);
  }
  return out;
}

std::vector<std::string> ConfigTable::texts(std::string_view key) const {
  const toml::node* node = node_->lookup(key);
  const auto* array = node != nullptr ? node->as_array() : nullptr;
  if (array == nullptr) fail(key, found_text(node) + ", allowed: an array of strings");
  std::vector<std::string> out;
  for (const toml::node& element : *array) {
    if (!element.is_string()) fail(key, found_text(&element) + " in the array, allowed: an array of strings");
    out.push_back(element.as_string()->get());
  }
  return out;
}

std::vector<double> ConfigTable::rigid_transform(std::string_view key) const {
  const toml::node* node = node_->lookup(key);
  const std::string allowed = ", allowed: a rigid transform, four rows of four finite numbers";
  const auto* rows = node != nullptr ? node->as_array() : nullptr;
  if (rows == nullptr || rows->size() != 4) fail(key, found_text(node) + allowed);
  std::vector<double> out;
  for (const toml::node& row : *rows) {
    if (!row.is_array() || row.as_array()->size() != 4) fail(key, found_text(&row) + " as a row" + allowed);
    for (const toml::node& element : *row.as_array()) {
      const std::optional<double> value = finite_number(&element);
      if (!value) fail(key, found_text(&element) + " in the matrix" + allowed);
      out.push_back(*value);
    }
  }
  constexpr double kTolerance = 1e-4;
  const Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>> matrix(out.data());
  if ((matrix.row(3) - Eigen::RowVector4d(0, 0, 0, 1)).cwiseAbs().maxCoeff() > 0) {
    fail(key, "found a last row other than 0 0 0 1" + allowed);
  }
  const Eigen::Matrix3d rotation = matrix.topLeftCorner<3, 3>();
  const double error = (rotation * rotation.transpose() - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  if (error > kTolerance) {
    fail(key, "found a 3x3 part that is not orthonormal (off by " + number_text(error) + ")" + allowed);
  }
  if (rotation.determinant() < 0) fail(key, "found a 3x3 part that mirrors (determinant -1)" + allowed);
  return out;
}

std::filesystem::path ConfigTable::existing_file(std::string_view key) const {
  const std::string value = text(key);
  std::filesystem::path path = folder() / value;
  std::error_code error;
  const bool one_line = std::none_of(value.begin(), value.end(), [](unsigned char c) { return c < 0x20; });
  if (value.empty() || !one_line || !std::filesystem::is_regular_file(path, error)) {
    fail(key, "found " + in_quotes(value) + ", which is no file, allowed: a file, relative to " + folder().string());
  }
  return path;
}

ConfigTable ConfigTable::table(std::string_view key) const {
  const toml::node* node = node_->lookup(key);
  if (node == nullptr || !node->is_table()) {
    fail(key, found_text(node) + ", allowed: a table [" + join(node_->path, key) + "]");
  }
  return ConfigTable(document_, node_->child(std::string(key), *node));
}

std::optional<ConfigTable> ConfigTable::optional_table(std::string_view key) const {
  return has(key) ? std::optional<ConfigTable>(table(key)) : std::nullopt;
}

std::vector<ConfigTable> ConfigTable::tables(std::string_view key) const {
  std::vector<ConfigTable> out;
  if (!has(key)) return out;
  const toml::node* node = node_->lookup(key);
  const std::string allowed = ", allowed: tables [[" + join(node_->path, key) + "]]";
  if (!node->is_array()) fail(key, found_text(node) + allowed);
  for (const toml::node& element : *node->as_array()) {
    if (!element.is_table()) fail(key, found_text(&element) + " in the array" + allowed);
    const std::string name = std::string(key) + "." + std::to_string(out.size());
    out.push_back(ConfigTable(document_, node_->child(name, element)));
  }
  return out;
}

const std::filesystem::path& ConfigTable::file() const { return document_->file; }

std::filesystem::path ConfigTable::folder() const {
  const std::filesystem::path parent = document_->file.parent_path();
  return parent.empty() ? std::filesystem::path(".") : parent;
}

void ConfigTable::finish() const {
  for (const auto& [key, value] : *node_->table) {
    if (node_->read.count(key.str()) == 0) {
      const std::string allowed = listed({node_->allowed.begin(), node_->allowed.end()});
      fail(key.str(), "found an unknown key, allowed: " + (allowed.empty() ? "none" : allowed));
    }
  }
  for (const auto& [key, node] : node_->children) ConfigTable(document_, node).finish();
}

}  // namespace lumigraft::capture
