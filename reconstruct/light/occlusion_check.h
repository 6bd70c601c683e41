#pragma once
// A fish-eye that something lies on: it says that there is no light, while the colour camera sees the room as before.
#include <optional>
#include <string>

#include "capture/camera/response.h"
#include "capture/frame.h"

namespace lumigraft::reconstruct {

/// Median radiance of a colour picture, mean of its channels; empty where there is no picture.
std::optional<float> room_level(const capture::Picture* color, const capture::Response& response);

class OcclusionCheck {
 public:
  struct Finding {
    bool covered = false;  ///< the picture is of no use: the light from before holds
    std::string warning;   ///< empty where all is well
  };
  /// `flux` is the integral of radiance over the fish-eye picture, mean of channels; `level` the room_level of the
  /// colour picture with it. `clipped`: the flux is a lower bound.
  Finding look(double flux, std::optional<float> level, bool clipped);

 private:
  bool seen_ = false;
  double flux_ = 0;  ///< of the last picture that was not covered
  std::optional<float> level_;
};

}  // namespace lumigraft::reconstruct
