#pragma once
// A kept room as a file, so that a restart knows it. Numbers are little-endian.
//
//   "LUMIROOM"                           8 bytes
//   format                               u32, 2
//   length of what follows               u32
//     voxel_m, truncation_m              f64 each
//     bricks: field, coarse, albedo      u64 each
//     lamps                              u64
//     world_name                         the rest
//   CRC-32 of all this                   u32
//   chunks until all bricks and lamps have come:
//     kind                               u32: 0 field, 1 coarse field, 2 albedo, 3 lamps; in this order
//     bricks or lamps                    u32, 1 to 256
//     length of the content              u32
//     CRC-32 of these three and of the content
//     content                            brick_codec.h, lamp_codec.h
//
// Field bricks near the tag come first.
#include <cstdint>
#include <filesystem>

#include "capture/session/session.h"
#include "reconstruct/fusion/parameters.h"
#include "reconstruct/kept_room/kept_room.h"

namespace lumigraft::reconstruct {

/// Replaces an older file in one step. At most 6.2 kB per brick of the field, usually a tenth. Returns the bytes.
/// Throws std::runtime_error.
std::uintmax_t write_room(const std::filesystem::path& file, const KeptRoom& room, const capture::Tag& tag);

/// Throws InputError for a file that is not of this format, of another version, world or size of voxels, cut short or
/// damaged. Of a room that does not fit into the memory of `settings` what is far from the tag is left out.
KeptRoom read_room(const std::filesystem::path& file, const capture::Tag& tag, const FusionSettings& settings);

}  // namespace lumigraft::reconstruct
