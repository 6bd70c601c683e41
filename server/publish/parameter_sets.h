#pragma once
// The parameter sets of an H.264 key frame: what a receiver must know before it decodes.
#include <cstdint>
#include <span>
#include <vector>

namespace lumigraft::server {

/// Sequence and picture parameter sets of an access unit in Annex B, with start codes of four bytes. Empty where it has
/// none.
std::vector<std::uint8_t> parameter_sets(std::span<const std::uint8_t> annex_b);

}  // namespace lumigraft::server
