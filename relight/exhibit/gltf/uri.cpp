#include "relight/exhibit/gltf/uri.h"

#include <array>
#include <cctype>
#include <string_view>

#include "capture/error.h"
#include "relight/exhibit/gltf/document.h"

namespace lumigraft::relight {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMaxNameCharacters = 200;

std::string percent_decoded(std::string_view uri) {
  std::string text;
  for (std::size_t i = 0; i < uri.size(); ++i) {
    const bool escape = uri[i] == '%' && i + 2 < uri.size() && std::isxdigit(static_cast<unsigned char>(uri[i + 1])) &&
                        std::isxdigit(static_cast<unsigned char>(uri[i + 2]));
    if (escape) {
      text += static_cast<char>(std::stoi(std::string(uri.substr(i + 1, 2)), nullptr, 16));
      i += 2;
    } else {
      text += uri[i];
    }
  }
  return text;
}

std::array<std::int8_t, 256> base64_values() {
  std::array<std::int8_t, 256> values;
  values.fill(-1);
  const std::string_view alphabet = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  for (std::size_t i = 0; i < alphabet.size(); ++i)
    values[static_cast<unsigned char>(alphabet[i])] = static_cast<std::int8_t>(i);
  return values;
}

std::vector<std::uint8_t> base64_decoded(const GltfValue& uri, std::string_view text) {
  static const std::array<std::int8_t, 256> values = base64_values();
  while (text.ends_with('=')) text.remove_suffix(1);
  std::vector<std::uint8_t> bytes;
  bytes.reserve(text.size() / 4 * 3 + 2);
  std::uint32_t bits = 0;
  int count = 0;
  for (const char c : text) {
    const std::int8_t value = values[static_cast<unsigned char>(c)];
    if (value < 0) uri.fail("found a character that is not of base64, allowed: base64");
    bits = bits << 6 | static_cast<std::uint32_t>(value);
    count += 6;
    if (count >= 8) bytes.push_back(static_cast<std::uint8_t>(bits >> (count -= 8)));
  }
  return bytes;
}

}  // namespace

std::vector<std::uint8_t> read_uri(const GltfValue& uri, const fs::path& folder, std::size_t max_bytes) {
  const std::string text = uri.text();
  if (text.starts_with("data:")) {
    const std::size_t comma = text.find(',');
    const std::string_view head = std::string_view(text).substr(0, comma);
    if (comma == std::string::npos || !head.ends_with(";base64"))
      uri.fail("found no base64, allowed: \"data:...;base64,\"");
    std::vector<std::uint8_t> bytes = base64_decoded(uri, std::string_view(text).substr(comma + 1));
    if (bytes.size() > max_bytes) {
      uri.fail("found " + std::to_string(bytes.size()) + " bytes, allowed: at most " + std::to_string(max_bytes));
    }
    return bytes;
  }
  fs::path path = folder / percent_decoded(text);
  std::error_code ignored;
  if (!fs::is_regular_file(path, ignored)) path = folder / text;  // exporters leave names unescaped
  try {
    return read_bytes(path, max_bytes);
  } catch (const capture::InputError& error) {
    std::string name = text.substr(0, kMaxNameCharacters);
    for (char& c : name) c = std::iscntrl(static_cast<unsigned char>(c)) ? ' ' : c;
    uri.fail("\"" + name + "\": " + error.what());
  }
}

}  // namespace lumigraft::relight
