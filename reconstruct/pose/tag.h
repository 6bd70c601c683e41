#pragma once
// Printed tags: their pattern, and detection of their corners in an image (libapriltag).
#include <Eigen/Geometry>
#include <array>
#include <memory>
#include <vector>

#include "capture/image.h"
#include "capture/session/session.h"

namespace lumigraft::reconstruct {

/// The tag as printed, in square cells, including the white border. Row 0 is the tag's top.
struct TagPattern {
  int cells = 0;                    ///< across the whole print
  int square_cells = 0;             ///< across the black square, whose edge is the tag's size
  std::vector<std::uint8_t> white;  ///< cells × cells; 1 = paper, 0 = ink

  bool white_at(int column, int row) const;  ///< outside the print that of the nearest cell
};

/// Corners of the black square in pixels: bottom left, bottom right, top right, top left of the upright tag.
using TagCorners = std::array<Eigen::Vector2d, 4>;

inline Eigen::AlignedBox2d box_of(const TagCorners& corners) {
  Eigen::AlignedBox2d box;
  for (const Eigen::Vector2d& corner : corners) box.extend(corner);
  return box;
}

/// A detected tag; pixels, where (0, 0) is the centre of the first pixel.
struct TagSighting {
  int id = 0;
  TagCorners corners;
  float decision_margin = 0;  ///< of libapriltag: how sure the code was read
};

class TagFinder {
 public:
  /// For this tag and its extra tags. Throws InputError for a family or id that does not exist.
  explicit TagFinder(const capture::Tag& tag);
  ~TagFinder();

  /// 0: the first tag, then the extra tags.
  const TagPattern& pattern(std::size_t index = 0) const { return patterns_[index]; }
  /// All sightings of these tags, by decreasing decision margin. `decimate`: squares are searched in an image reduced
  /// by this factor, which is faster by its square and misses small tags; corners are refined at full resolution.
  std::vector<TagSighting> find(const capture::Image<std::uint8_t>& grey, int decimate);

 private:
  struct Detector;
  std::unique_ptr<Detector> detector_;
  std::vector<TagPattern> patterns_;
};

}  // namespace lumigraft::reconstruct
