#pragma once
// What the passes left on the device, as pictures of the program.
#include <memory>

#include "relight/passes/screen/screen.h"
#include "relight/renderer.h"

namespace lumigraft::relight {

/// The camera's code values with the blocks that were composed.
capture::Image<std::uint8_t> read_picture(gpu::Device& device, const Screen& screen,
                                          const capture::Image<std::uint8_t>& coded);
/// Where an object shows, the maps say what it is.
std::shared_ptr<const RelightMaps> read_maps(gpu::Device& device, const Screen& screen);

}  // namespace lumigraft::relight
