#pragma once
// Bricks of the field and of albedo as bytes: quantized, differences of successive voxels, low and high bytes apart,
// deflated (zlib). Distances are exact to half of a 1024th of the truncation distance, weights to 0.4 %, albedo to half
// of a 4096th.
#include <cstdint>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "reconstruct/albedo/albedo.h"
#include "reconstruct/field/distance_field.h"

namespace lumigraft::reconstruct {

using Bytes = std::vector<std::uint8_t>;
template <typename Brick>
using KeyedBricks = std::vector<std::pair<BrickKey, std::shared_ptr<const Brick>>>;

Bytes encode_bricks(const KeyedBricks<FieldBrick>& bricks, float truncation_m);
/// `common_error`: sigma is stored as sigma_later with it; what is as uncertain as a guess becomes unknown.
Bytes encode_bricks(const KeyedBricks<AlbedoBrick>& bricks, float common_error);

// `count`: of the bricks. These throw InputError: what was found and what is allowed.
KeyedBricks<FieldBrick> decode_field_bricks(std::span<const std::uint8_t> bytes, std::size_t count, float truncation_m);
KeyedBricks<AlbedoBrick> decode_albedo_bricks(std::span<const std::uint8_t> bytes, std::size_t count);

}  // namespace lumigraft::reconstruct
