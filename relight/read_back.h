#pragma once
// What the passes left on the device, as pictures of the program.
#include <cstddef>
#include <memory>
#include <span>

#include "relight/passes/screen/screen.h"
#include "relight/renderer.h"

namespace lumigraft::relight {

/// The camera's code values, with the blocks that were composed taken from `drawn`: the texels of screen.picture.
capture::Image<std::uint8_t> with_drawn_blocks(const capture::Image<std::uint8_t>& coded,
                                               std::span<const std::byte> drawn, const Screen& screen);
/// Where an object shows, the maps say what it is.
std::shared_ptr<const RelightMaps> read_maps(gpu::Device& device, const Screen& screen);

}  // namespace lumigraft::relight
