#pragma once
// Converts camera frames to linear radiance.
#include <cstdint>
#include <memory>
#include <vector>

#include "capture/camera/response.h"
#include "capture/frame.h"

namespace lumigraft::capture {

/// Pixel values from here on are lower bounds of the radiance: lens blur, JPEG and noise smear saturation below 255.
constexpr std::uint8_t kFullScale = 250;

struct RadianceImage {
  Image<float> radiance;        ///< W/sr/m² per channel, R G B
  Image<std::uint8_t> clipped;  ///< 1 channel; 1 where a channel is at full scale in every exposure: a lower bound
  double clipped_fraction = 0.0;
};

/// radiance = response(pixel value) / exposure. Frames of radiance pass through; values that are not finite or are
/// negative become 0, and those that are not finite are marked as clipped.
RadianceImage to_radiance(const Frame& frame, const Response& response);

/// Merges the exposures of a bracket (Debevec & Malik 1997, eq. 6 with a known response). The weights favour the
/// longest exposure that is not near full scale. One frame alone is converted as by to_radiance.
RadianceImage merge_bracket(const std::vector<std::shared_ptr<const Frame>>& frames, const Response& response);

/// Multiplies each pixel by `gain` of vignetting_gain(); an empty one does nothing.
void undo_vignetting(RadianceImage& image, const Image<float>& gain);

}  // namespace lumigraft::capture
