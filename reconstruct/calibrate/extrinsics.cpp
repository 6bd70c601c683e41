#include "reconstruct/calibrate/extrinsics.h"

#include <limits>

#include "reconstruct/calibrate/acceptance.h"
#include "reconstruct/calibrate/initial_guess.h"
#include "reconstruct/calibrate/parameters.h"
#include "reconstruct/math/median.h"
#include "reconstruct/math/rotation_vector.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Isometry3d;

double median_error_px(const Adjustment& adjusted) {
  std::vector<double> errors;
  for (const Residual& residual : adjusted.residuals) errors.push_back(residual.error_px.norm());
  return median(errors);
}

/// The medoid: the guess with the smallest median distance from the others.
Isometry3d middle_of(const std::vector<Isometry3d>& guesses) {
  double min_distance = std::numeric_limits<double>::infinity();
  Isometry3d best = Isometry3d::Identity();
  for (const Isometry3d& guess : guesses) {
    std::vector<double> apart;  // metres and radians, of similar magnitude here
    for (const Isometry3d& other : guesses)
      apart.push_back((guess.translation() - other.translation()).norm() + angle_between(guess, other));
    if (const double middle = median(apart); middle < min_distance) {
      min_distance = middle;
      best = guess;
    }
  }
  return best;
}

capture::CameraModel unlimited(capture::CameraModel camera) {
  camera.fov_rad = 0;
  return camera;
}

}  // namespace

ExtrinsicsCalibration calibrate_extrinsics(const capture::CameraModel& first, const capture::CameraModel& second,
                                           const std::vector<BoardView>& first_views,
                                           const std::vector<BoardView>& second_views) {
  ExtrinsicsCalibration extrinsics;
  Rig rig{{unlimited(first), unlimited(second)}, {Isometry3d::Identity(), Isometry3d::Identity()}, {}};
  std::vector<std::array<std::optional<Isometry3d>, 2>> poses;
  std::vector<Isometry3d> guesses;
  for (std::size_t i = 0; i < first_views.size(); ++i) {
    poses.push_back({board_pose(first_views[i], rig.cameras[0]), board_pose(second_views[i], rig.cameras[1])});
    if (poses.back()[0] && poses.back()[1]) guesses.push_back(*poses.back()[1] * poses.back()[0]->inverse());
  }
  extrinsics.moments = static_cast<int>(guesses.size());
  if (extrinsics.moments >= kCalibration.min_moments) {
    rig.T_camera_first[1] = middle_of(guesses);
    RigViews views(2);
    for (std::size_t i = 0; i < poses.size(); ++i) {
      if (!poses[i][0] && !poses[i][1]) continue;
      rig.T_first_board.push_back(poses[i][0] ? *poses[i][0] : rig.T_camera_first[1].inverse() * *poses[i][1]);
      views[0].push_back(poses[i][0] ? first_views[i] : BoardView{});
      views[1].push_back(poses[i][1] ? second_views[i] : BoardView{});
    }
    extrinsics.median_px = std::numeric_limits<double>::infinity();
    if (const auto adjusted = adjust(rig, views, Freedom::all)) {
      extrinsics.T_second_first = adjusted->rig.T_camera_first[1];
      const Eigen::VectorXd sigma = adjusted->covariance.diagonal().tail<6>().cwiseSqrt();
      extrinsics.turn_sigma_rad = sigma.head<3>();
      extrinsics.shift_sigma_m = sigma.tail<3>();
      extrinsics.median_px = median_error_px(*adjusted);
      for (const Residual& residual : adjusted->residuals)
        extrinsics.outliers += (residual.outlier ? 1.0 : 0.0) / static_cast<double>(adjusted->residuals.size());
    }
  }
  extrinsics.refusal = rejection_reason(extrinsics);
  return extrinsics;
}

RoomTagPose place_room_tag(const capture::CameraModel& first, const capture::CameraModel& second,
                           const std::optional<Isometry3d>& T_second_first,
                           const std::array<std::vector<SeenPoints>, 2>& seen) {
  RoomTagPose place;
  // The second camera defines the frame; where it does not see the tag, the first camera does.
  Rig rig{{unlimited(second), unlimited(first)}, {Isometry3d::Identity(), Isometry3d::Identity()}, {}};
  if (T_second_first) rig.T_camera_first[1] = T_second_first->inverse();
  const RigViews views = {{BoardView{seen[1]}}, {BoardView{T_second_first ? seen[0] : std::vector<SeenPoints>{}}}};
  for (const auto& camera : views) place.pictures += static_cast<int>(camera[0].seen.size());
  if (place.pictures == 0) {
    place.refusal = "no picture shows it";
    return place;
  }
  std::optional<Adjustment> best;
  for (std::size_t c = 0; c < 2; ++c) {
    const auto pose = board_pose(views[c][0], rig.cameras[c]);
    if (!pose) continue;
    rig.T_first_board = {rig.T_camera_first[c].inverse() * *pose};
    const auto adjusted = adjust(rig, views, Freedom::poses);
    if (adjusted && (!best || median_error_px(*adjusted) < median_error_px(*best))) best = adjusted;
  }
  place.median_px = best ? median_error_px(*best) : std::numeric_limits<double>::infinity();
  if (best) place.T_camera_tag = best->rig.T_first_board[0];
  place.refusal = rejection_reason(place);
  return place;
}

}  // namespace lumigraft::reconstruct
