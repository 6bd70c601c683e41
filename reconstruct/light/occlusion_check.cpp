#include "reconstruct/light/occlusion_check.h"

#include <algorithm>
#include <numbers>
#include <vector>

namespace lumigraft::reconstruct {
namespace {

constexpr int kEvery = 7;          ///< pixels of a colour picture looked at, either way
constexpr double kDark = 0.05;     ///< of the light there was
constexpr float kSameRoom = 0.5f;  ///< of the level there was: the lamps still burn
constexpr double kMostReturned =
    5;  ///< of the light that arrives; surfaces nearer to a lamp than the fish-eye have more

}  // namespace

std::optional<float> room_level(const capture::Picture* color, const capture::Response& response) {
  if (!color) return std::nullopt;
  const bool linear = !color->radiance.empty();
  const int width = linear ? color->radiance.width : color->encoded.width;
  const int height = linear ? color->radiance.height : color->encoded.height;
  std::vector<float> levels;
  for (int v = 0; v < height; v += kEvery) {
    for (int u = 0; u < width; u += kEvery) {
      float sum = 0;
      for (int c = 0; c < 3; ++c) {
        sum += linear ? color->radiance.at(u, v, c)
                      : static_cast<float>(response.to_linear(color->encoded.at(u, v, c), c) / color->exposure);
      }
      levels.push_back(sum / 3);
    }
  }
  if (levels.empty()) return std::nullopt;
  const auto middle = levels.begin() + static_cast<std::ptrdiff_t>(levels.size() / 2);
  std::nth_element(levels.begin(), middle, levels.end());
  return *middle;
}

OcclusionCheck::Finding OcclusionCheck::look(double flux, std::optional<float> level, bool clipped) {
  Finding finding;
  // Without a colour picture to say that the lamps still burn, dark is dark.
  if (seen_ && flux < kDark * flux_ && level && level_ && *level_ > 0 && *level > kSameRoom * *level_) {
    finding.covered = true;
    finding.warning =
        "the fish-eye is covered: it went dark while the colour camera sees the room as before; "
        "the light is held as it was";
    return finding;
  }
  seen_ = true;
  flux_ = flux;
  level_ = level;
  if (!clipped && level && std::numbers::pi * *level > kMostReturned * flux) {
    finding.warning =
        "the fish-eye sees far less light than the room sends back to the colour camera: it is covered, "
        "or one of their exposures is wrong";
  }
  return finding;
}

}  // namespace lumigraft::reconstruct
