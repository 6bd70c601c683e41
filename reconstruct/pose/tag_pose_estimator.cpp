#include "reconstruct/pose/tag_pose_estimator.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "reconstruct/math/planar_pose.h"
#include "reconstruct/math/rotation_vector.h"
#include "reconstruct/pose/depth_plane.h"
#include "reconstruct/pose/gray_regions.h"
#include "reconstruct/pose/parameters.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector2d;

constexpr double kDegree = M_PI / 180;
constexpr int kTile = 8;  // pixels of the detector's tiles

/// 1σ of systematic errors at the corners.
double bias_px(const PoseCandidate& candidate) {
  return kTagPose.bias_sigma_px * (1 + (candidate.alignment ? candidate.alignment->clipped_fraction : 0));
}

std::optional<TagCorners> projected(const Isometry3d& T_camera_tag, double size_m, const capture::CameraModel& camera) {
  const auto square = tag_corners(size_m);
  TagCorners corners;
  for (int i = 0; i < 4; ++i) {
    const auto pixel = camera.project(T_camera_tag * square[i]);
    if (!pixel) return std::nullopt;
    corners[i] = *pixel;
  }
  return corners;
}

}  // namespace

PixelRegion tiles_around(const TagCorners& points, const capture::CameraModel& camera) {
  const Eigen::AlignedBox2d box = box_of(points);
  const Vector2d margin = (box.sizes() / 2).cwiseMax(kTagSearch.min_margin_px);
  return region_around(box.min() - margin, box.max() + margin, camera.width, camera.height, kTile);
}

double narrowest_px(const TagCorners& points) {
  double twice_area = 0, longest = 0;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Vector2d &a = points[i], &b = points[(i + 1) % points.size()];
    twice_area += a.x() * b.y() - a.y() * b.x();
    longest = std::max(longest, (b - a).norm());
  }
  return longest > 0 ? std::abs(twice_area) / 2 / longest : 0;
}

TagPoseEstimator::TagPoseEstimator(const TagPattern& pattern, double size_m, const capture::CameraModel& camera,
                                   const capture::Response& response)
    : pattern_(pattern), size_m_(size_m), camera_(camera), response_(response) {}

std::optional<TagCorners> TagPoseEstimator::corners_at(const Isometry3d& T_camera_tag) const {
  return projected(T_camera_tag, size_m_, camera_);
}

std::optional<TagPoseEstimator::SearchRegion> TagPoseEstimator::search_region(const Isometry3d& T_camera_tag) const {
  const auto print = projected(T_camera_tag, size_m_ * pattern_.cells / pattern_.square_cells, camera_);
  if (!print) return std::nullopt;
  const PixelRegion region = tiles_around(*print, camera_);
  if (region.width < 4 * kTile || region.height < 4 * kTile ||
      2 * region.width * region.height > camera_.width * camera_.height)
    return std::nullopt;
  return SearchRegion{region, narrowest_px(*print)};
}

void TagPoseEstimator::align(PoseCandidate& candidate, const std::vector<PixelSample>& pixels) const {
  const auto& before = candidate.alignment;
  candidate.alignment = align_to_print(pixels, pattern_, size_m_, candidate.T_camera_tag,
                                       before ? std::optional(before->appearance) : std::nullopt);
  if (!candidate.alignment) return;
  candidate.T_camera_tag = candidate.alignment->T_camera_tag;
  constexpr double kFactor = kTagPose.print_sigma_factor;
  candidate.position_sigma_m = std::max(kFactor * candidate.alignment->position_sigma_m, kTagPose.min_sigma);
  candidate.angle_sigma_rad = std::max(kFactor * candidate.alignment->angle_sigma_rad, kTagPose.min_sigma);
  candidate.noise = kFactor * kFactor * candidate.alignment->covariance;
}

/// Errors that are the same in all frames, and what is not known of the shutter: constant while the motion is.
PoseCovariance TagPoseEstimator::bias_of(const PoseCandidate& candidate, const ImageMotion& motion) const {
  const double focal_px = (camera_.fx + camera_.fy) / 2;
  PoseCovariance bias = square_covariance(candidate.T_camera_tag, size_m_, bias_px(candidate) / focal_px);
  const auto corners = corners_at(candidate.T_camera_tag);
  if (!corners) return bias;
  const auto add = [&](double row_s, const auto& velocity_at) {
    SquareCorners displacement;
    double largest_px = 0;
    for (std::size_t i = 0; i < displacement.size(); ++i) {
      const Vector2d shift_px = ((*corners)[i].y() - motion.row) * row_s * velocity_at((*corners)[i]);
      largest_px = std::max(largest_px, shift_px.norm());
      displacement[i] = shift_px.cwiseQuotient(Vector2d(camera_.fx, camera_.fy));
    }
    if (largest_px > kRollingShutter.min_shift_px)
      bias += displaced_covariance(candidate.T_camera_tag, size_m_, displacement);
  };
  add(motion.row_time.sigma_s, [&](const Vector2d& pixel) { return motion.velocity_at(pixel); });
  for (const Vector2d& axis : {Vector2d(1, 0), Vector2d(0, 1)})
    add(motion.row_time.seconds, [&](const Vector2d&) -> Vector2d { return motion.velocity_sigma_px_s * axis; });
  return bias;
}

void TagPoseEstimator::compute_costs(std::vector<PoseCandidate>& candidates, const PoseHints& hints) const {
  double best_contrast = std::numeric_limits<double>::max();
  for (const PoseCandidate& pose : candidates)
    if (pose.alignment) best_contrast = std::min(best_contrast, pose.alignment->contrast_error);
  for (PoseCandidate& pose : candidates) {
    pose.cost = std::min(kTagPose.evidence_cap, std::pow(pose.error_px / kTagPose.corner_cost_px, 2));
    if (best_contrast < std::numeric_limits<double>::max()) {
      const double ratio = pose.alignment ? pose.alignment->contrast_error / best_contrast : kTagPose.missing_print;
      const double independent =
          pose.alignment ? pose.alignment->pixels / kTagPose.pixels_per_sample : kTagPose.missing_print;
      pose.cost += std::min(kTagPose.evidence_cap, independent * (ratio * ratio - 1));
    }
    if (hints.T_camera_tag_before) {
      const double angle = angle_between(pose.T_camera_tag, *hints.T_camera_tag_before);
      const double sigma_rad = (kTagPose.still_deg + kTagPose.deg_per_s * hints.elapsed_s) * kDegree;
      pose.cost += std::min(kTagPose.evidence_cap, std::pow(angle / sigma_rad, 2));
    }
  }
}

std::vector<PoseCandidate> TagPoseEstimator::estimate(const TagCorners& corners, const capture::Frame& picture,
                                                      const PoseHints& hints) const {
  SquareCorners rays;
  for (int i = 0; i < 4; ++i) {
    const auto direction = camera_.unproject(hints.motion.at_row_time(corners[i]));
    if (!direction || direction->z() <= 0) return {};
    rays[i] = direction->head<2>() / direction->z();
  }
  const double focal_px = (camera_.fx + camera_.fy) / 2;
  std::vector<PlanarPose> starts = solve_square(rays, size_m_);
  const std::size_t minima = starts.size();
  if (minima == 1) {
    // Noise can merge the two minima of four corners; the whole print may still have both.
    const Isometry3d other = mirrored(starts[0].T_camera_tag);
    starts.push_back({other, square_error(other, rays, size_m_)});
  }
  const std::vector<PixelSample> pixels = sample_pixels(
      picture, response_, camera_, region_of_print(corners, pattern_, camera_.width, camera_.height), hints.motion);
  const std::vector<PixelSample> few = thin_out(pixels);
  const auto aligned = [&](PoseCandidate& candidate, const std::vector<PixelSample>& seen) {
    align(candidate, seen);
    if (candidate.alignment) candidate.error_px = square_error(candidate.T_camera_tag, rays, size_m_) * focal_px;
  };
  std::vector<PoseCandidate> result;
  for (std::size_t i = 0; i < starts.size(); ++i) {
    const PlanarPose& start = starts[i];
    // The corners alone decide if one pose fits them much worse.
    if (i > 0 && (start.error - starts[0].error) * focal_px > kTagPose.max_corner_gap_px) break;
    PoseCandidate candidate;
    candidate.T_camera_tag = start.T_camera_tag;
    candidate.error_px = start.error * focal_px;
    // The residual is a lower limit of the corners' error; its effect on the pose grows with distance over size.
    const double corner_px = std::max(kTagPose.corner_sigma_px, candidate.error_px);
    const double distance_m = start.T_camera_tag.translation().norm();
    candidate.angle_sigma_rad = corner_px / focal_px * distance_m / size_m_;
    candidate.position_sigma_m = candidate.angle_sigma_rad * distance_m;
    candidate.noise = square_covariance(start.T_camera_tag, size_m_, corner_px / focal_px);
    // A subset of the pixels brings the pose close to the result of all pixels, and rejects most wrong poses.
    aligned(candidate, few);
    if (!candidate.alignment && few.size() < pixels.size()) aligned(candidate, pixels);
    if (!candidate.alignment && i >= minima) break;  // the mirror image is no minimum
    result.push_back(candidate);
  }
  compute_costs(result, hints);
  // Drop a candidate that depth cannot save any more.
  if (result.size() == 2 && std::abs(result[0].cost - result[1].cost) > kTagPose.evidence_cap)
    result.erase(result.begin() + (result[0].cost > result[1].cost ? 0 : 1));
  for (PoseCandidate& candidate : result)
    if (candidate.alignment) aligned(candidate, pixels);
  if (result.size() == 2 &&
      angle_between(result[0].T_camera_tag, result[1].T_camera_tag) < kTagPose.same_pose_deg * kDegree)
    result.pop_back();
  compute_costs(result, hints);
  const auto plane =
      result.size() == 2 && hints.depth_m ? plane_inside(*hints.depth_m, camera_, corners) : std::nullopt;
  for (PoseCandidate& candidate : result) {
    candidate.bias = bias_of(candidate, hints.motion);
    if (!plane) continue;
    const double cosine = std::clamp(plane->normal.dot(candidate.T_camera_tag.linear().col(2)), -1.0, 1.0);
    candidate.cost += std::min(kTagPose.evidence_cap, std::pow(std::acos(cosine) / (2 * plane->angle_sigma_rad), 2));
  }
  return result;
}

std::optional<PoseCandidate> TagPoseEstimator::follow(const capture::Frame& picture, const Isometry3d& T_camera_tag,
                                                      const PrintAppearance& appearance,
                                                      const ImageMotion& motion) const {
  const auto corners = projected(T_camera_tag, size_m_, camera_);
  if (!corners) return std::nullopt;
  const PixelRegion region = region_of_print(*corners, pattern_, camera_.width, camera_.height);
  if (region.width < 3 || region.height < 3) return std::nullopt;
  const std::vector<PixelSample> pixels = sample_pixels(picture, response_, camera_, region, motion);
  PoseCandidate candidate;
  candidate.T_camera_tag = T_camera_tag;
  candidate.alignment.emplace();
  candidate.alignment->appearance = appearance;
  // First on a subset of the pixels, which rejects most frames while the tag is hidden.
  align(candidate, thin_out(pixels));
  if (!candidate.alignment || candidate.alignment->contrast_error > kTagPose.follow_contrast_error) return std::nullopt;
  align(candidate, pixels);
  if (!candidate.alignment || candidate.alignment->contrast_error > kTagPose.follow_contrast_error) return std::nullopt;
  const PrintAppearance& now = candidate.alignment->appearance;
  const double contrast = now.contrast() / appearance.contrast();
  if (!(contrast > kTagPose.follow_min_contrast && contrast < kTagPose.follow_max_contrast)) return std::nullopt;
  if ((candidate.T_camera_tag.translation() - T_camera_tag.translation()).norm() > kTagPose.follow_m ||
      angle_between(candidate.T_camera_tag, T_camera_tag) > kTagPose.follow_rad)
    return std::nullopt;
  candidate.bias = bias_of(candidate, motion);
  return candidate;
}

}  // namespace lumigraft::reconstruct
