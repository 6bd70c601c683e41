#pragma once
// Bundle adjustment of one camera or of two that are fixed to each other (Triggs et al. 2000): lenses, how the second
// camera stands to the first, and where the board was at every moment.
#include <Eigen/Geometry>
#include <optional>
#include <vector>

#include "capture/camera/camera_model.h"
#include "reconstruct/calibrate/board_detection.h"
#include "reconstruct/calibrate/lens.h"

namespace lumigraft::reconstruct {

struct Rig {
  std::vector<capture::CameraModel> cameras;
  std::vector<Eigen::Isometry3d> T_camera_first;  ///< by camera; the first is the identity
  std::vector<Eigen::Isometry3d> T_first_board;   ///< by moment
};

/// What each camera saw, moment by moment: views[camera][moment], empty where it saw no board.
using RigViews = std::vector<std::vector<BoardView>>;

struct Residual {
  int camera = 0;
  int moment = 0;
  Eigen::Vector2d pixel;
  Eigen::Vector2d error_px;  ///< projected minus seen
  bool outlier = false;      ///< left out of the result: no lens explains it
};

struct Adjustment {
  Rig rig;
  std::vector<Residual> residuals;
  /// Of the lenses' numbers and, for a second camera, of the turn (rad) and shift (m) of T_second_first, from the left:
  /// kLensNumbers rows for each camera, then six. Numbers that were not free have 0.
  Eigen::MatrixXd covariance;
};

/// Each with those before it. `poses` are the board's alone, `focal_length` frees how the cameras stand, too.
enum class Freedom { poses, focal_length, all };

/// Starts from `rig`. Empty where the start cannot be projected, or the unknowns do not follow from the views.
std::optional<Adjustment> adjust(const Rig& rig, const RigViews& views, Freedom freedom);

}  // namespace lumigraft::reconstruct
