#pragma once
// Rolling shutter: the rows of an image are exposed one after the other, so that a moving camera sees the corners of a
// tag from different places. A single pose explains that shear of its image as a tilt.
//
// All points of a tag are moved to where they were in the image when the row of the tag's centre was exposed, by the
// motion of their image. The mean of that motion follows from the corners and from where the last pose projects them,
// its gradient over the tag from the last two poses. An error of the pose that is due to the shear does not move the
// tag's centre, so that errors of one frame hardly change the motion in the next.
#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <vector>

#include "reconstruct/pose/tag.h"

namespace lumigraft::reconstruct {

/// Time between neighbouring rows.
struct RowTime {
  double seconds = 0;  ///< 0: none, or not known
  double sigma_s = 0;  ///< 1σ; not 0 if it is not known

  /// `readout_s`: between the first and the last of `rows` rows; empty: not known.
  static RowTime of(const std::optional<double>& readout_s, int rows);
};

/// How a tag's image moves, and where its points were when `row` was exposed.
struct ImageMotion {
  double row = 0;  ///< whose time the pose is for
  RowTime row_time;
  Eigen::Vector2d centre = Eigen::Vector2d::Zero();
  Eigen::Vector2d velocity_px_s = Eigen::Vector2d::Zero();   ///< of the centre
  double velocity_sigma_px_s = 0;                            ///< 1σ of each component
  Eigen::Matrix2d gradient_per_s = Eigen::Matrix2d::Zero();  ///< of the velocity by the pixel

  Eigen::Vector2d velocity_at(const Eigen::Vector2d& pixel) const {
    return velocity_px_s + gradient_per_s * (pixel - centre);
  }
  Eigen::Vector2d at_row_time(const Eigen::Vector2d& pixel) const {
    return pixel - (pixel.y() - row) * row_time.seconds * velocity_at(pixel);
  }
};

/// What is uncertain of the shutter follows from the camera's motion, which the images of all tags show. A tag that is
/// pushed moves on its own as well: its uncertainty becomes that of the tag whose image is calmest. `seen`: by tag.
void limit_to_common_motion(std::vector<ImageMotion>& motions, const std::vector<bool>& seen);

/// Follows the image of one tag.
class TagImageMotion {
 public:
  /// Where the last pose projects the tag.
  struct Expected {
    TagCorners corners;
    std::int64_t pose_ns = 0;  ///< time of that pose
    double sigma_px = 0;       ///< of where the corners are, if the pose does not follow from tags
  };

  /// Motion at the time of `row`, `now_ns`. To be called in each frame in which the tag may be. Empty `seen`: its
  /// square is not detected. `usual_px_s`: 1σ of the velocity if nothing is known of it.
  ImageMotion update(const std::optional<TagCorners>& seen, const std::optional<Expected>& expected, double row,
                     std::int64_t now_ns, const RowTime& row_time, double usual_px_s);

 private:
  std::optional<Expected> before_;  ///< of the last frame
  double change_px_s_ = 0;          ///< of the velocity, that acceleration added in the last frame
};

}  // namespace lumigraft::reconstruct
