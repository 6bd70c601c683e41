#pragma once
// The printed tag: what it looks like, and where its corners are in a picture (libapriltag).
#include <Eigen/Core>
#include <array>
#include <memory>
#include <vector>

#include "capture/image.h"
#include "capture/session/session.h"

namespace lumigraft::reconstruct {

/// The tag as printed, in square cells, quiet border included. Row 0 is the tag's top.
struct TagPattern {
  int cells = 0;                    ///< across the whole print
  int square_cells = 0;             ///< across the black square, whose edge is the tag's size
  std::vector<std::uint8_t> white;  ///< cells × cells; 1 = paper, 0 = ink

  bool white_at(int column, int row) const;  ///< beyond the print, the nearest cell
};

/// Corners of the black square in pixels: bottom left, bottom right, top right, top left of the upright tag.
using TagCorners = std::array<Eigen::Vector2d, 4>;

struct TagSighting {
  int id = 0;
  TagCorners corners;
};

class TagFinder {
 public:
  /// Finds this tag and those beside it. Throws InputError for a family or number that does not exist.
  explicit TagFinder(const capture::Tag& tag);
  ~TagFinder();

  const TagPattern& pattern() const { return patterns_.front(); }                  ///< of the tag itself
  const TagPattern& pattern(std::size_t index) const { return patterns_[index]; }  ///< 0: the tag, then those beside it
  /// Every sighting of these very tags, the surest first. `decimate`: looks for squares in a picture as many times
  /// smaller, which misses small ones and takes less time by its square.
  std::vector<TagSighting> find(const capture::Image<std::uint8_t>& grey, int decimate);

 private:
  struct Detector;
  std::unique_ptr<Detector> detector_;
  std::vector<TagPattern> patterns_;
};

}  // namespace lumigraft::reconstruct
