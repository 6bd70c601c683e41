#pragma once
// Search for tags in a region of an image or in all of it.
#include <optional>
#include <vector>

#include "capture/camera/camera_model.h"
#include "capture/frame.h"
#include "reconstruct/pose/gray_regions.h"
#include "reconstruct/pose/tag.h"

namespace lumigraft::reconstruct {

class TagSearch {
 public:
  /// Throws InputError for a family or id that does not exist.
  TagSearch(const capture::Tag& tag, const capture::CameraModel& camera) : camera_(camera), finder_(tag) {}

  /// Of the first tag (0) and the extra tags.
  const TagPattern& pattern(std::size_t index) const { return finder_.pattern(index); }
  /// Whether an image has the camera's size.
  bool fits(const capture::Frame& picture) const;

  /// All sightings of a tag of about this width in a region.
  std::vector<TagSighting> in_region(const capture::Frame& picture, const PixelRegion& region, double narrowest_px,
                                     int id);
  /// Resolution of the search in a whole image: half takes a quarter of the time and misses small tags.
  enum class Resolution { half, half_then_full, full };
  /// All tags in the image. Corners are measured in a region around each tag, so that tracking gives the same values.
  std::vector<TagSighting> in_image(const capture::Frame& picture, Resolution resolution);
  /// Tags that are seen mirrored, each once, with the corners where they are in the image. At the detector's full
  /// resolution.
  std::vector<TagSighting> mirrored_in_image(const capture::Frame& picture);

 private:
  capture::CameraModel camera_;
  TagFinder finder_;
  float gain_ = 1;  ///< detector_gain of the last whole image
};

/// Mean of the four corners.
Eigen::Vector2d centre_of(const TagCorners& corners);
/// Adds those of `more` that are not in `found`: another sighting of the id within a few pixels is the same.
void add_new_sightings(std::vector<TagSighting>& found, const std::vector<TagSighting>& more);
std::size_t count_sightings(const std::vector<TagSighting>& sightings, int id);
/// The sighting of the id nearest to `pixel`, or the first of the id without `pixel`; null if there is none.
const TagSighting* nearest_sighting(const std::vector<TagSighting>& sightings, int id,
                                    const std::optional<Eigen::Vector2d>& pixel);

}  // namespace lumigraft::reconstruct
