#include "reconstruct/pose/tag_search.h"

#include <algorithm>

#include "reconstruct/pose/parameters.h"
#include "reconstruct/pose/tag_pose_estimator.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Vector2d;

/// Smallest decimation for an image or region of this width.
int min_decimation(int width) { return width <= kTagSearch.full_resolution_px ? 1 : 2; }

}  // namespace

Vector2d centre_of(const TagCorners& corners) { return (corners[0] + corners[1] + corners[2] + corners[3]) / 4; }

void add_new_sightings(std::vector<TagSighting>& found, const std::vector<TagSighting>& more) {
  for (const TagSighting& sighting : more) {
    const TagSighting* same = nearest_sighting(found, sighting.id, centre_of(sighting.corners));
    if (!same || (centre_of(same->corners) - centre_of(sighting.corners)).norm() >= kTagSearch.same_sighting_px)
      found.push_back(sighting);
  }
}

std::size_t count_sightings(const std::vector<TagSighting>& sightings, int id) {
  return static_cast<std::size_t>(std::count_if(sightings.begin(), sightings.end(),
                                                [id](const TagSighting& sighting) { return sighting.id == id; }));
}

const TagSighting* nearest_sighting(const std::vector<TagSighting>& sightings, int id,
                                    const std::optional<Vector2d>& pixel) {
  const TagSighting* nearest = nullptr;
  for (const TagSighting& sighting : sightings) {
    if (sighting.id != id) continue;
    if (!nearest ||
        (pixel && (centre_of(sighting.corners) - *pixel).norm() < (centre_of(nearest->corners) - *pixel).norm()))
      nearest = &sighting;
  }
  return nearest;
}

bool TagSearch::fits(const capture::Frame& picture) const {
  return std::max(picture.encoded.width, picture.radiance.width) == camera_.width &&
         std::max(picture.encoded.height, picture.radiance.height) == camera_.height;
}

std::vector<TagSighting> TagSearch::in_region(const capture::Frame& picture, const PixelRegion& region,
                                              double narrowest_px, int id) {
  const capture::Image<std::uint8_t> grey = detector_codes(picture, region, gain_);
  const int fine = min_decimation(region.width);
  std::vector<TagSighting> found;
  for (int decimate = narrowest_px >= kTagSearch.wide_tag_px * fine ? 2 * fine : fine;
       found.empty() && decimate >= fine; decimate /= 2) {
    found = finder_.find(grey, decimate);
    std::erase_if(found, [id](const TagSighting& sighting) { return sighting.id != id; });
  }
  for (TagSighting& sighting : found)
    for (Vector2d& corner : sighting.corners) corner += Vector2d(region.left, region.top);
  return found;
}

std::vector<TagSighting> TagSearch::in_image(const capture::Frame& picture, Resolution resolution) {
  if (!picture.radiance.empty()) gain_ = detector_gain(picture.radiance);
  const capture::Image<std::uint8_t> grey = detector_codes(picture, {0, 0, camera_.width, camera_.height}, gain_);
  std::vector<TagSighting> coarse;
  if (resolution != Resolution::full) coarse = finder_.find(grey, 2 * min_decimation(camera_.width));
  if (coarse.empty() && resolution != Resolution::half) coarse = finder_.find(grey, min_decimation(camera_.width));
  std::vector<TagSighting> found;
  for (const TagSighting& sighting : coarse) {
    const std::vector<TagSighting> in_tiles =
        in_region(picture, tiles_around(sighting.corners, camera_), narrowest_px(sighting.corners), sighting.id);
    const TagSighting* nearest = nearest_sighting(in_tiles, sighting.id, centre_of(sighting.corners));
    found.push_back(nearest ? *nearest : sighting);
  }
  return found;
}

std::vector<TagSighting> TagSearch::mirrored_in_image(const capture::Frame& picture) {
  capture::Image<std::uint8_t> grey = detector_codes(picture, {0, 0, camera_.width, camera_.height}, gain_);
  for (int v = 0; v < grey.height; ++v) std::reverse(&grey.at(0, v), &grey.at(0, v) + grey.width);
  std::vector<TagSighting> found = finder_.find(grey, min_decimation(camera_.width));
  std::ranges::stable_sort(found, {}, &TagSighting::id);
  const auto same_id = [](const TagSighting& a, const TagSighting& b) { return a.id == b.id; };
  found.erase(std::unique(found.begin(), found.end(), same_id), found.end());
  for (TagSighting& sighting : found)
    for (Vector2d& corner : sighting.corners) corner.x() = grey.width - 1 - corner.x();
  return found;
}

}  // namespace lumigraft::reconstruct
