#pragma once
// Detection of a covered fish-eye: it measures no light while the colour camera sees the room as before.
#include <optional>
#include <string>

#include "capture/camera/response.h"
#include "capture/frame.h"

namespace lumigraft::reconstruct {

/// Median radiance of a colour image, mean of the channels; empty if there is no image.
std::optional<float> median_radiance(const capture::Frame* color, const capture::Response& response);

class OcclusionCheck {
 public:
  struct Finding {
    bool covered = false;  ///< the image must not be used: the previous light stays
    std::string warning;   ///< empty if nothing is wrong
  };
  /// `flux`: ∫ L dω over the fish-eye image, mean of channels; a lower bound if `clipped`. `room_radiance`:
  /// median_radiance of the colour image of the same moment.
  Finding check(double flux, std::optional<float> room_radiance, bool clipped);

 private:
  bool seen_ = false;
  double flux_ = 0;  ///< of the last image that was not covered
  std::optional<float> room_radiance_;
};

}  // namespace lumigraft::reconstruct
