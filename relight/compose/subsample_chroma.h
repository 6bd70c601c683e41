#pragma once
// Gives objects the resolution in colour that the camera has.
#include <cstdint>

#include "capture/formats/chroma_sampling.h"
#include "capture/image.h"
#include "relight/compose/object_layer.h"

namespace lumigraft::relight {

/// In each block of pixels that shows a part of an object, all get the mean of their chroma (BT.601, full range) and
/// keep their luma. `picture`: composed, sRGB.
void subsample_chroma(const capture::ChromaBlock& block, const ObjectLayer& objects,
                      capture::Image<std::uint8_t>* picture);

}  // namespace lumigraft::relight
