#pragma once
// TOML configuration. Every error names file, line and key, what was found and what is allowed.
//
// A ConfigTable is read key by key; `finish()` then refuses keys that were not read, so that a misspelt key is
// reported. Example:
//
//   ConfigTable root = ConfigTable::load(dir / "session.toml", {"fisheye.source=images:fisheye-ldr.txt"});
//   ConfigTable color = root.table("color");
//   int width = color.integer("width", 1, 16384);
//   double exposure = color.number("exposure", 1e-9, 1e9);
//   root.finish();                       // checks this table and every table taken from it
//
// All functions throw InputError: "session.toml:7: color.width: found \"wide\", allowed: an integer from 1 to 16384".
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace lumigraft::capture {

/// The TOML text from which a session's cameras were read. Recordings copy the text, so that no number is rounded.
struct SessionText {
  std::filesystem::path file;
  std::vector<std::string> overrides;  ///< KEY=VALUE, applied to the file's text
};

/// The file's text with the overrides applied. Throws InputError.
std::string text_with_overrides(const SessionText& text);

class ConfigTable {
 public:
  /// `overrides` are KEY=VALUE as of `--set`: dotted key, TOML value or bare string. They are applied before anything
  /// is read; errors in them name "--set KEY".
  static ConfigTable load(const std::filesystem::path& file, const std::vector<std::string>& overrides = {});
  static ConfigTable parse(std::string_view text, const std::string& name,
                           const std::vector<std::string>& overrides = {});

  bool has(std::string_view key) const;
  /// Every key of this table, in alphabetical order: for names that are not this program's, as of camera controls.
  std::vector<std::string> keys() const;

  double number(std::string_view key, double low, double high) const;
  double number(std::string_view key, double low, double high, double fallback) const;
  int integer(std::string_view key, int low, int high) const;
  int integer(std::string_view key, int low, int high, int fallback) const;
  bool flag(std::string_view key, bool fallback) const;
  std::string text(std::string_view key) const;
  std::string text(std::string_view key, std::string_view fallback) const;
  /// One of the allowed words.
  std::string choice(std::string_view key, const std::vector<std::string>& allowed, std::string_view fallback) const;
  /// Array of exactly `count` finite numbers.
  std::vector<double> numbers(std::string_view key, std::size_t count) const;
  std::vector<double> numbers(std::string_view key, std::size_t min_count, std::size_t max_count) const;
  /// Array of strings.
  std::vector<std::string> texts(std::string_view key) const;
  /// 4x4 rigid transform as four rows, row-major. Refuses NaN, a last row other than 0 0 0 1, and rotations that are
  /// not orthonormal to 1e-4 or mirror.
  std::vector<double> rigid_transform(std::string_view key) const;
  /// Path of an existing file, relative to the configuration's folder.
  std::filesystem::path existing_file(std::string_view key) const;

  ConfigTable table(std::string_view key) const;  ///< required
  std::optional<ConfigTable> optional_table(std::string_view key) const;
  std::vector<ConfigTable> tables(std::string_view key) const;  ///< [[key]]; empty if absent

  const std::filesystem::path& file() const;
  std::filesystem::path folder() const;  ///< relative paths start here

  [[noreturn]] void fail(std::string_view key, const std::string& found_and_allowed) const;
  /// Accepts a key of earlier versions that has no effect any more; adds a warning if it is present.
  void obsolete(std::string_view key) const;
  /// The key to read where `former` was renamed to `key`: `former` if the table has it, with one warning per document;
  /// else `key`. A table with both is refused.
  std::string_view renamed(std::string_view key, std::string_view former) const;
  /// One line for every obsolete key and every former name found in the document's tables.
  const std::vector<std::string>& warnings() const;
  /// Refuses keys that were not read, in this table and those taken from it.
  void finish() const;

 private:
  struct Document;
  struct Node;
  ConfigTable(std::shared_ptr<Document> document, std::shared_ptr<Node> node);
  std::string location_of(std::string_view key) const;
  void warn(std::string_view key, const std::string& text) const;
  std::shared_ptr<Document> document_;
  std::shared_ptr<Node> node_;
};

}  // namespace lumigraft::capture
