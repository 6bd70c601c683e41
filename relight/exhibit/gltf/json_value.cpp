#include "relight/exhibit/gltf/json_value.h"

#include <cmath>
#include <nlohmann/json.hpp>

#include "capture/error.h"

namespace lumigraft::relight {
namespace {

using nlohmann::json;

constexpr std::size_t kMaxFoundCharacters = 40;

std::string found(const json& value) {
  if (value.is_array()) return "an array of " + std::to_string(value.size());
  if (value.is_object()) return "an object";
  std::string text = value.dump(-1, ' ', /*ensure_ascii=*/true, json::error_handler_t::replace);
  if (text.size() > kMaxFoundCharacters) text = text.substr(0, kMaxFoundCharacters) + "...";
  return text;
}

std::string readable(double x) {
  std::string text = json(x).dump();
  return text.ends_with(".0") ? text.substr(0, text.size() - 2) : text;
}

}  // namespace

void GltfValue::fail(const std::string& found_and_allowed) const {
  throw capture::InputError(*file_ + ": " + (where_.empty() ? "" : where_ + ": ") + found_and_allowed);
}

void GltfValue::refuse(const std::string& allowed) const {
  fail("found " + (value_ ? found(*value_) : "none") + ", allowed: " + allowed);
}

GltfValue GltfValue::member(std::string_view key) const {
  std::string where = where_.empty() ? std::string(key) : where_ + "." + std::string(key);
  if (!value_) return {*this, std::move(where), nullptr};
  if (!value_->is_object()) refuse("an object");
  const auto at = value_->find(key);
  return {*this, std::move(where), at == value_->end() || at->is_null() ? nullptr : &*at};
}

std::vector<std::string> GltfValue::keys() const {
  std::vector<std::string> all;
  if (!value_) return all;
  if (!value_->is_object()) refuse("an object");
  for (const auto& [key, value] : value_->items()) all.push_back(key);
  return all;
}

std::size_t GltfValue::size() const {
  if (!value_) return 0;
  if (!value_->is_array()) refuse("an array");
  return value_->size();
}

GltfValue GltfValue::operator[](std::size_t element) const {
  return {*this, where_ + "[" + std::to_string(element) + "]", &(*value_)[element]};
}

double GltfValue::number(double low, double high) const {
  const bool is_number = value_ && value_->is_number();
  const double x = is_number ? value_->get<double>() : NAN;
  if (!(x >= low && x <= high)) refuse("a number from " + readable(low) + " to " + readable(high));
  return x;
}

double GltfValue::number(std::string_view key, double low, double high, double otherwise) const {
  const GltfValue value = member(key);
  return value.exists() ? value.number(low, high) : otherwise;
}

std::optional<std::vector<double>> GltfValue::numbers(std::string_view key, std::size_t count, double low,
                                                      double high) const {
  const GltfValue array = member(key);
  if (!array.exists()) return std::nullopt;
  if (array.size() != count) array.refuse(std::to_string(count) + " numbers");
  std::vector<double> all;
  for (std::size_t i = 0; i < count; ++i) all.push_back(array[i].number(low, high));
  return all;
}

std::size_t GltfValue::integer(std::size_t low, std::size_t high) const {
  const bool is_natural = value_ && value_->is_number_unsigned();
  const std::size_t x = is_natural ? value_->get<std::size_t>() : 0;
  if (!is_natural || x < low || x > high) {
    refuse("an integer from " + std::to_string(low) + " to " + std::to_string(high));
  }
  return x;
}

std::size_t GltfValue::integer(std::string_view key, std::size_t low, std::size_t high, std::size_t otherwise) const {
  const GltfValue value = member(key);
  return value.exists() ? value.integer(low, high) : otherwise;
}

bool GltfValue::flag(std::string_view key, bool otherwise) const {
  const GltfValue value = member(key);
  if (!value.exists()) return otherwise;
  if (!value.value_->is_boolean()) value.refuse("true or false");
  return value.value_->get<bool>();
}

std::string GltfValue::text() const {
  if (!value_ || !value_->is_string()) refuse("a text");
  return value_->get<std::string>();
}

std::string GltfValue::text(std::string_view key, const std::string& otherwise) const {
  const GltfValue value = member(key);
  return value.exists() ? value.text() : otherwise;
}

std::size_t GltfValue::index(std::size_t count, std::string_view what) const {
  const bool is_natural = value_ && value_->is_number_unsigned();
  const std::size_t x = is_natural ? value_->get<std::size_t>() : count;
  if (x >= count) refuse("the number of one of " + std::to_string(count) + " " + std::string(what));
  return x;
}

}  // namespace lumigraft::relight
