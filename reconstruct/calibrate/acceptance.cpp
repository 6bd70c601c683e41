#include "reconstruct/calibrate/acceptance.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "capture/message_text.h"
#include "reconstruct/calibrate/parameters.h"

namespace lumigraft::reconstruct {
namespace {

constexpr double kDegree_rad = std::numbers::pi / 180;
constexpr auto& kAllowed = kCalibration.acceptance;
constexpr int kMinViews = kCalibration.min_views, kMinMoments = kCalibration.min_moments;

using capture::formatted;
using Eigen::Vector3d;

/// Why a relative pose with these 1σ is rejected; `pose` and `remedy` complete the sentence.
std::string pose_rejection_reason(const char* pose, const Vector3d& turn_sigma_rad, const Vector3d& shift_sigma_m,
                                  const char* remedy) {
  const double turn = turn_sigma_rad.maxCoeff(), shift = shift_sigma_m.maxCoeff();
  if (turn <= kAllowed.max_turn_sigma_rad && shift <= kAllowed.max_shift_sigma_m) return {};
  return formatted("uncertainty: found %s known to %.2f° and %.1f mm, allowed: %.1f° and %.0f mm; %s", pose,
                   turn / kDegree_rad, 1e3 * shift, kAllowed.max_turn_sigma_rad / kDegree_rad,
                   1e3 * kAllowed.max_shift_sigma_m, remedy);
}

}  // namespace

std::string rejection_reason(const CameraCalibration& c) {
  if (c.views < kMinViews)
    return formatted("too few views: found %d pictures that show the board in a new place, allowed: at least %d",
                     c.views, kMinViews);
  if (c.corners == 0)
    return "no lens explains the views: is the board flat, and rows, columns, size_m and spacing_m as printed?";
  if (c.outliers > kAllowed.max_outliers * c.corners)
    return formatted(
        "residual: found %.0f %% of the corners to be outliers, allowed: at most %.0f %%; is the board "
        "flat, and rows, columns, size_m and spacing_m as printed?",
        100.0 * c.outliers / c.corners, 100 * kAllowed.max_outliers);
  if (!(c.median_px <= kAllowed.max_px))
    return formatted(
        "residual: found corners %.2f px in the median from their projections, allowed: at most %.1f px; "
        "is the board flat, and size_m and spacing_m as printed?",
        c.median_px, kAllowed.max_px);
  if (c.coverage.reached() < kAllowed.min_reached)
    return formatted(
        "coverage: found corners in %.0f %% of the %s, allowed: at least %.0f %%; hold the board to the %s",
        100 * c.coverage.reached(), c.coverage.rings ? "field" : "picture", 100 * kAllowed.min_reached,
        c.coverage.missing().c_str());
  const double focal = std::max(c.sigma[0] / c.model.fx, c.sigma[1] / c.model.fy);
  if (!(focal <= kAllowed.max_focal_sigma))
    return formatted(
        "uncertainty: found the focal length known to %.2f %%, allowed: %.1f %%; hold the board at a slant, "
        "turned to either side",
        100 * focal, 100 * kAllowed.max_focal_sigma);
  const double centre_px = std::max(c.sigma[2], c.sigma[3]);
  if (!(centre_px <= kAllowed.max_centre_sigma_px))
    return formatted(
        "uncertainty: found the principal point known to %.2f px, allowed: %.1f px; take more views, at a slant "
        "and near the picture's sides",
        centre_px, kAllowed.max_centre_sigma_px);
  if (!(c.widest_sigma_px <= kAllowed.max_sigma_px))
    return formatted(
        "uncertainty: found places in the picture known to %.1f px alone, allowed: %.1f px; hold the board to the "
        "%s",
        c.widest_sigma_px, kAllowed.max_sigma_px,
        c.coverage.missing().empty() ? "picture's rim" : c.coverage.missing().c_str());
  return {};
}

std::string rejection_reason(const ExtrinsicsCalibration& s) {
  if (s.moments < kMinMoments)
    return formatted("too few views: found %d moments at which both cameras see the board, allowed: at least %d",
                     s.moments, kMinMoments);
  if (!(s.median_px <= kAllowed.max_px) || s.outliers > kAllowed.max_outliers)
    return formatted(
        "residual: found corners %.2f px in the median from where both cameras together put them, %.0f %% of them far "
        "off, allowed: at most %.1f px and %.0f %%; did one camera move, or the board between their pictures?",
        s.median_px, 100 * s.outliers, kAllowed.max_px, 100 * kAllowed.max_outliers);
  return pose_rejection_reason("the cameras' relative pose", s.turn_sigma_rad, s.shift_sigma_m,
                               "take more views that both see, nearer and at a slant");
}

std::string rejection_reason(const RoomTagPose& place) {
  if (!(place.median_px <= kAllowed.max_px))
    return formatted(
        "residual: found its corners %.2f px in the median from one place in the room, allowed: at most %.1f px; "
        "did the tag or the camera move?",
        place.median_px, kAllowed.max_px);
  return {};
}

std::string rejection_reason(const VignettingCalibration& v) {
  if (v.moments < kMinViews)
    return formatted("too few views: found %d pictures with white paper that is not clipped, allowed: at least %d",
                     v.moments, kMinViews);
  if (!(v.widest_sigma <= kAllowed.max_falloff_sigma))
    return formatted(
        "uncertainty: found the lens's falloff known to %.0f %% alone at the edge of its field, allowed: %.0f %%; hold "
        "the board nearer to the rim, in even light",
        100 * v.widest_sigma, 100 * kAllowed.max_falloff_sigma);
  if (!(v.edge >= kAllowed.min_transmission && v.edge <= kAllowed.max_transmission))
    return formatted("found %.3f of the axis' light at the edge of the field, allowed: %.2f to %.0f", v.edge,
                     kAllowed.min_transmission, kAllowed.max_transmission);
  return {};
}

std::string rejection_reason(const TimeOffsetCalibration& t) {
  if (t.pictures < kMinMoments)
    return formatted(
        "too few pictures: found %d of the fish-eye that show the board between pictures of the colour camera, "
        "allowed: at least %d; move the board to and fro where both see it",
        t.pictures, kMinMoments);
  if (!(std::abs(t.offset_s) <= kAllowed.max_offset_s))
    return formatted("found an offset of %.0f ms or more, allowed: at most %.0f ms", 1e3 * t.offset_s,
                     1e3 * kAllowed.max_offset_s);
  if (!(t.median_px <= kAllowed.max_moving_px))
    return formatted(
        "residual: found corners of the moving board %.2f px in the median from its trajectory, allowed: at "
        "most %.0f px; move it slowly",
        t.median_px, kAllowed.max_moving_px);
  if (!(t.sigma_s <= kAllowed.max_offset_sigma_s))
    return formatted(
        "uncertainty: found the offset known to %.1f ms alone, allowed: %.0f ms; move the board to and fro where both "
        "see it",
        1e3 * t.sigma_s, 1e3 * kAllowed.max_offset_sigma_s);
  return {};
}

std::string rejection_reason(const DepthCalibration& d) {
  if (d.views < kMinViews)
    return formatted("too few views: found %d pictures whose depth shows the board, allowed: at least %d", d.views,
                     kMinViews);
  if (!(d.median_m <= kAllowed.max_from_board_m))
    return formatted(
        "residual: found depth %.1f mm in the median from the board, allowed: at most %.0f mm; is unit_m right, and "
        "the depth camera's lens?",
        1e3 * d.median_m, 1e3 * kAllowed.max_from_board_m);
  return pose_rejection_reason("the depth camera's pose", d.turn_sigma_rad, d.shift_sigma_m,
                               "hold the board at more slants, turned to either side");
}

}  // namespace lumigraft::reconstruct
