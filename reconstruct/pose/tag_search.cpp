#include "reconstruct/pose/tag_search.h"

#include <algorithm>
#include <optional>

#include "reconstruct/pose/tag_pose_estimator.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Vector2d;

/// Full resolution while the tag may be small in the picture; half beyond, where corners are refined anyway.
int finest(int width) { return width <= 640 ? 1 : 2; }
/// A tag so wide is found as well at half of it, in a quarter of the time: the library needs three pixels a cell or so,
/// of eight, and refines corners in the whole picture.
constexpr double kWide_px = 64;

}  // namespace

Vector2d centre_of(const TagCorners& corners) { return (corners[0] + corners[1] + corners[2] + corners[3]) / 4; }

bool TagSearch::fits(const capture::Picture& picture) const {
  return std::max(picture.encoded.width, picture.radiance.width) == camera_.width &&
         std::max(picture.encoded.height, picture.radiance.height) == camera_.height;
}

std::vector<TagSighting> TagSearch::in_region(const capture::Picture& picture, const PixelRegion& region,
                                              double narrowest_px, int id) {
  const capture::Image<std::uint8_t> codes = detector_codes(picture, region, gain_);
  const int fine = finest(region.width);
  std::vector<TagSighting> found;
  for (int decimate = narrowest_px >= kWide_px * fine ? 2 * fine : fine; found.empty() && decimate >= fine;
       decimate /= 2) {
    found = finder_.find(codes, decimate);
    std::erase_if(found, [id](const TagSighting& sighting) { return sighting.id != id; });
  }
  for (TagSighting& sighting : found)
    for (Vector2d& corner : sighting.corners) corner += Vector2d(region.left, region.top);
  return found;
}

std::vector<TagSighting> TagSearch::everywhere(const capture::Picture& picture, Depth depth) {
  if (!picture.radiance.empty()) gain_ = detector_gain(picture.radiance);
  const capture::Image<std::uint8_t> codes = detector_codes(picture, {0, 0, camera_.width, camera_.height}, gain_);
  std::vector<TagSighting> coarse;
  if (depth != Depth::full) coarse = finder_.find(codes, 2 * finest(camera_.width));
  if (coarse.empty() && depth != Depth::half) coarse = finder_.find(codes, finest(camera_.width));
  std::vector<TagSighting> found;
  for (const TagSighting& sighting : coarse) {
    const Vector2d centre = centre_of(sighting.corners);
    std::optional<TagSighting> nearest;
    for (const TagSighting& again :
         in_region(picture, tiles_around(sighting.corners, camera_), narrowest_px(sighting.corners), sighting.id))
      if (!nearest || (centre_of(again.corners) - centre).norm() < (centre_of(nearest->corners) - centre).norm())
        nearest = again;
    found.push_back(nearest.value_or(sighting));
  }
  return found;
}

}  // namespace lumigraft::reconstruct
