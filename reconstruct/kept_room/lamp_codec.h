#pragma once
// Lamps as bytes: position, radius and sigma as f32 each, and u32 flags (1 flat, 2 beam), 24 bytes a lamp.
#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "reconstruct/lamps/kept_lamp.h"

namespace lumigraft::reconstruct {

std::vector<std::uint8_t> encode_lamps(const std::vector<KeptLamp>& lamps);
/// Throws InputError: what was found and what is allowed.
std::vector<KeptLamp> decode_lamps(std::span<const std::uint8_t> bytes, std::size_t count);

}  // namespace lumigraft::reconstruct
