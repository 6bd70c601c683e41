#pragma once
// A value of a glTF file's JSON, and where it is. What is read is checked for type and range.
#include <cstddef>
#include <cstdint>
#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace lumigraft::relight {

/// Keeps a pointer to the document. A member that is absent or null is a value that does not exist. All verbs throw
/// InputError with the file, the place of the value, what was found and what is allowed.
class GltfValue {
 public:
  GltfValue(const std::string& file, const nlohmann::json& root)
      : file_(std::make_shared<const std::string>(file)), value_(&root) {}

  bool exists() const { return value_ != nullptr; }
  /// As in "meshes[0].primitives[2]"; empty for the root.
  const std::string& where() const { return where_; }

  GltfValue member(std::string_view key) const;
  GltfValue extension(std::string_view name) const { return member("extensions").member(name); }
  std::vector<std::string> keys() const;  ///< of an object; empty if it does not exist
  std::size_t size() const;               ///< of an array; 0 if it does not exist
  GltfValue operator[](std::size_t element) const;
  GltfValue none() const { return {*this, where_, nullptr}; }  ///< one that does not exist

  // Of a member, or its default.
  double number(std::string_view key, double low, double high, double otherwise) const;
  /// So many numbers; nothing if the member does not exist.
  std::optional<std::vector<double>> numbers(std::string_view key, std::size_t count, double low, double high) const;
  std::size_t integer(std::string_view key, std::size_t low, std::size_t high, std::size_t otherwise) const;
  bool flag(std::string_view key, bool otherwise) const;
  std::string text(std::string_view key, const std::string& otherwise) const;

  // Of the value itself, which must exist.
  std::size_t integer(std::size_t low, std::size_t high) const;
  std::string text() const;
  /// Of an array with `count` elements, `what` by name.
  std::size_t index(std::size_t count, std::string_view what) const;

  [[noreturn]] void fail(const std::string& found_and_allowed) const;
  /// With the value as found.
  [[noreturn]] void refuse(const std::string& allowed) const;

 private:
  GltfValue(const GltfValue& parent, std::string where, const nlohmann::json* value)
      : file_(parent.file_), where_(std::move(where)), value_(value) {}
  double number(double low, double high) const;

  std::shared_ptr<const std::string> file_;
  std::string where_;
  const nlohmann::json* value_;
};

}  // namespace lumigraft::relight
