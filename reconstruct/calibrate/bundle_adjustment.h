#pragma once
// Bundle adjustment of one camera, or of two that are rigidly mounted (Triggs et al. 2000): lenses, relative camera
// pose, and the board's pose at every moment.
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

/// Observations of each camera: views[camera][moment], empty where it saw no board.
using RigViews = std::vector<std::vector<BoardView>>;

struct Residual {
  int camera = 0;
  int moment = 0;
  Eigen::Vector2d pixel;
  Eigen::Vector2d error_px;  ///< projected minus observed
  bool outlier = false;      ///< excluded from the result
};

struct Adjustment {
  Rig rig;
  std::vector<Residual> residuals;
  /// Covariance of the lens parameters and, for a second camera, of the left perturbation of T_second_first: rotation
  /// (rad), then translation (m). kLensNumbers rows for each camera, then six. Fixed parameters have 0.
  Eigen::MatrixXd covariance;
};

/// The free parameters; each value includes the previous ones. `poses`: board poses only; `focal_length` also frees the
/// relative camera pose.
enum class Freedom { poses, focal_length, all };

/// Minimises from the initial values in `rig`. Empty where they cannot be projected, or the views do not determine the
/// unknowns.
std::optional<Adjustment> adjust(const Rig& rig, const RigViews& views, Freedom freedom);

}  // namespace lumigraft::reconstruct
