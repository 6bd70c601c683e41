#pragma once
// Camera pictures to linear radiance.
#include <cstdint>
#include <memory>
#include <vector>

#include "capture/camera/response.h"
#include "capture/frame.h"

namespace lumigraft::capture {

/// From this code value on a reading says "at least": lenses, JPEG and noise blur 255.
constexpr std::uint8_t kFullScale = 250;

struct RadiancePicture {
  Image<float> radiance;        ///< W/sr/m² per channel, R G B
  Image<std::uint8_t> clipped;  ///< 1 channel; 1 where any channel reads full scale in every exposure: a lower bound
  double clipped_fraction = 0.0;
};

/// radiance = response(code) / exposure. Pictures that hold radiance pass through unchanged.
RadiancePicture to_radiance(const Picture& picture, const Response& response);

/// One picture or the exposures of a bracket, merged by weights that trust the longest exposure not near full scale
/// (Debevec & Malik 1997, eq. 6 with a known response).
RadiancePicture merge_bracket(const std::vector<std::shared_ptr<const Picture>>& pictures, const Response& response);

/// Takes out what the lens let through less, pixel by pixel. `gain` is that of vignetting.h; an empty one does nothing.
void undo_vignetting(RadiancePicture& picture, const Image<float>& gain);

}  // namespace lumigraft::capture
