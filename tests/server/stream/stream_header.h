#pragma once
// Parses the header of a stream message; same as the page's protocol.js.
#include <algorithm>
#include <optional>
#include <span>
#include <string_view>

#include "server/stream/protocol.h"

namespace lumigraft::server {

template <typename T>
T little_endian(std::span<const std::uint8_t> in, std::size_t offset) {
  std::uint64_t value = 0;
  for (std::size_t i = 0; i < sizeof(T); ++i) {
    value |= static_cast<std::uint64_t>(in[offset + i]) << (8 * i);
  }
  return static_cast<T>(value);
}

/// Empty where the message is malformed.
inline std::optional<StreamHeader> parse_stream_header(std::span<const std::uint8_t> bytes) {
  constexpr std::string_view magic = "LUMI";
  if (bytes.size() < kStreamHeaderBytes || !std::equal(magic.begin(), magic.end(), bytes.begin()) ||
      bytes[4] != kProtocolVersion || bytes[5] < 1 || bytes[5] > 4) {
    return std::nullopt;
  }
  StreamHeader header;
  header.kind = static_cast<StreamKind>(bytes[5]);
  header.flags = little_endian<std::uint16_t>(bytes, 6);
  header.sequence = little_endian<std::uint32_t>(bytes, 8);
  header.width = little_endian<std::uint16_t>(bytes, 12);
  header.height = little_endian<std::uint16_t>(bytes, 14);
  header.capture_time_ns = little_endian<std::int64_t>(bytes, 16);
  header.send_time_ns = little_endian<std::int64_t>(bytes, 24);
  return header;
}

}  // namespace lumigraft::server
