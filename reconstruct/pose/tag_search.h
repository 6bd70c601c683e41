#pragma once
// Where tags are looked for: in a part of the picture where they were, or all over it.
#include <vector>

#include "capture/camera/camera_model.h"
#include "capture/frame.h"
#include "reconstruct/pose/gray_regions.h"
#include "reconstruct/pose/tag.h"

namespace lumigraft::reconstruct {

class TagSearch {
 public:
  /// Throws InputError for a tag that does not exist.
  TagSearch(const capture::Tag& tag, const capture::CameraModel& camera) : camera_(camera), finder_(tag) {}

  /// Of the tag itself (0) and those beside it.
  const TagPattern& pattern(std::size_t index) const { return finder_.pattern(index); }
  /// Whether a picture is one of the camera's.
  bool fits(const capture::Picture& picture) const;

  /// A tag of about this width, every time that a region shows it.
  std::vector<TagSighting> in_region(const capture::Picture& picture, const PixelRegion& region, double narrowest_px,
                                     int id);
  /// Which resolutions a whole picture is searched at: half of it takes a quarter of the time and misses small tags.
  enum class Depth { half, half_then_full, full };
  /// Every tag in the picture, with the corners that a region around it shows: what tracking measures, too.
  std::vector<TagSighting> everywhere(const capture::Picture& picture, Depth depth);

 private:
  capture::CameraModel camera_;
  TagFinder finder_;
  float gain_ = 1;  ///< of the last search over a whole picture
};

/// Of its four corners.
Eigen::Vector2d centre_of(const TagCorners& corners);

}  // namespace lumigraft::reconstruct
