#pragma once
// Over how many pixels a camera averages colour: chroma is sampled more coarsely than luma in most video formats.
#include "capture/formats/pixel_format.h"

namespace lumigraft::capture {

/// Pixels with one value of chroma.
struct ChromaBlock {
  int width = 1, height = 1;
};

/// Of a frame as the camera delivers it; {1, 1} of other formats: Bayer patterns have no subsampled chroma.
ChromaBlock chroma_block(const RawFrame& frame);

}  // namespace lumigraft::capture
