#include "reconstruct/pose.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>
#include <utility>

#include "reconstruct/pose_alignment.h"
#include "reconstruct/pose_filter.h"
#include "reconstruct/pose_picture.h"
#include "reconstruct/pose_plane.h"
#include "reconstruct/pose_solver.h"
#include "reconstruct/pose_tag.h"

namespace lumigraft {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kDegree = M_PI / 180;
constexpr double kCap = 100;  // each witness for a pose counts as squared deviations in σ, and for no more than this

std::pair<Vector2d, Vector2d> extent(const TagCorners& points) {
  Vector2d low = points[0], high = points[0];
  for (const Vector2d& point : points) {
    low = low.cwiseMin(point);
    high = high.cwiseMax(point);
  }
  return {low, high};
}

/// The detector's tiles: a region on their grid shows it the same tiles as the whole picture.
constexpr int kGrid = 8;

/// Full resolution while the tag may be small in the picture; half beyond, where corners are refined anyway.
int finest(int width) { return width <= 640 ? 1 : 2; }

/// The points, and half their extent around them: what a hand moves a tag between two pictures.
PixelRegion tiles_around(const TagCorners& points, const CameraModel& camera) {
  const auto [low, high] = extent(points);
  const Vector2d around = ((high - low) / 2).cwiseMax(16);
  return region_around(low - around, high + around, camera.width, camera.height, kGrid);
}

/// Where to look for the print if the camera hardly moved. Empty where that would be most of the picture.
std::optional<PixelRegion> region_of_tag(const Isometry3d& T_camera_tag, const TagPattern& pattern, double size_m,
                                         const CameraModel& camera) {
  const double half_m = size_m / 2 * pattern.cells / pattern.square_cells;
  TagCorners print;
  for (int i = 0; i < 4; ++i) {
    const auto pixel = camera.project(T_camera_tag * Vector3d(i % 2 ? half_m : -half_m, i / 2 ? half_m : -half_m, 0));
    if (!pixel) return std::nullopt;
    print[i] = *pixel;
  }
  const PixelRegion region = tiles_around(print, camera);
  if (region.width < 4 * kGrid || region.height < 4 * kGrid ||
      2 * region.width * region.height > camera.width * camera.height)
    return std::nullopt;
  return region;
}

/// Around the corners, by the paper that alignment reads and the neighbours that its pixels need.
PixelRegion region_of_corners(const TagCorners& corners, const TagPattern& pattern, const CameraModel& camera) {
  const auto [low, high] = extent(corners);
  const Vector2d around = (high - low) / pattern.square_cells + Vector2d::Constant(3);
  return region_around(low - around, high + around, camera.width, camera.height);
}

struct Candidate {
  Isometry3d T_camera_tag = Isometry3d::Identity();
  double error_px = 0;
  double position_sigma_m = 0;
  double angle_sigma_rad = 0;
  std::optional<Alignment> alignment;
};

double angle_between(const Isometry3d& a, const Isometry3d& b) {
  return Eigen::AngleAxisd(Eigen::Matrix3d(a.linear().transpose() * b.linear())).angle();
}

std::string format(const char* pattern, double value) {
  char text[200];
  std::snprintf(text, sizeof(text), pattern, value);
  return text;
}

}  // namespace

struct PoseStage::State {
  State(const Tag& tag_in, const CameraModel& camera_in, const Response& response_in)
      : tag(tag_in), camera(camera_in), response(response_in), finder(tag_in) {}

  bool recent(const FrameSet& frame) const;
  std::vector<TagCorners> find(const FrameSet& frame);
  std::vector<TagCorners> find_in(const Picture& picture, const PixelRegion& region);
  std::vector<Candidate> candidates(const TagCorners& corners, const FrameSet& frame) const;
  void align(Candidate& candidate, const SquareCorners& rays, const std::vector<SeenPixel>& pixels) const;
  std::vector<double> costs(const std::vector<Candidate>& poses, const FrameSet& frame) const;
  std::size_t choose(const std::vector<Candidate>& poses, const TagCorners& corners, const FrameSet& frame,
                     std::vector<std::string>& warnings) const;
  bool measure(const FrameSet& frame, std::vector<std::string>& warnings);

  Tag tag;
  CameraModel camera;
  Response response;
  TagFinder finder;
  PoseFilter filter;
  std::optional<Pose> last;
  float gain = 1;  ///< of the last search over a whole picture
};

bool PoseStage::State::recent(const FrameSet& frame) const {
  return last && frame.time_ns > last->time_ns && frame.time_ns - last->time_ns <= kAgeLimitNs;
}

std::vector<TagCorners> PoseStage::State::find_in(const Picture& picture, const PixelRegion& region) {
  std::vector<TagCorners> sightings = finder.find(detector_codes(picture, region, gain), finest(region.width));
  for (TagCorners& corners : sightings)
    for (Vector2d& corner : corners) corner += Vector2d(region.left, region.top);
  return sightings;
}

std::vector<TagCorners> PoseStage::State::find(const FrameSet& frame) {
  const Picture& picture = *frame.color;
  const Image<float>& radiance = picture.radiance;
  const int width = std::max(picture.encoded.width, radiance.width);
  const int height = std::max(picture.encoded.height, radiance.height);
  if (width != camera.width || height != camera.height) return {};
  if (recent(frame)) {
    const auto region = region_of_tag(last->T_tag_camera_raw.inverse(), finder.pattern(), tag.size_m, camera);
    if (region) {
      std::vector<TagCorners> sightings = find_in(picture, *region);
      if (!sightings.empty()) return sightings;
    }
  }
  if (!radiance.empty()) gain = detector_gain(radiance);
  const PixelRegion whole{0, 0, width, height};
  const Image<std::uint8_t> codes = detector_codes(picture, whole, gain);
  const std::vector<TagCorners> coarse = finder.find(codes, 2 * finest(width));
  if (coarse.size() == 1) {
    std::vector<TagCorners> sightings = find_in(picture, tiles_around(coarse.front(), camera));
    if (!sightings.empty()) return sightings;
  }
  return finder.find(codes, finest(width));
}

void PoseStage::State::align(Candidate& candidate, const SquareCorners& rays,
                             const std::vector<SeenPixel>& pixels) const {
  const auto& before = candidate.alignment;
  candidate.alignment = align_to_print(pixels, finder.pattern(), tag.size_m, candidate.T_camera_tag,
                                       before ? std::optional(before->look) : std::nullopt);
  if (!candidate.alignment) return;
  candidate.T_camera_tag = candidate.alignment->T_camera_tag;
  candidate.error_px = square_error(candidate.T_camera_tag, rays, tag.size_m) * (camera.fx + camera.fy) / 2;
  // The residuals call noise independent from pixel to pixel; measured errors are three times as large.
  candidate.position_sigma_m = std::max(3 * candidate.alignment->position_sigma_m, 1e-5);
  candidate.angle_sigma_rad = std::max(3 * candidate.alignment->angle_sigma_rad, 1e-5);
}

std::vector<Candidate> PoseStage::State::candidates(const TagCorners& corners, const FrameSet& frame) const {
  SquareCorners rays;
  for (int i = 0; i < 4; ++i) {
    const auto direction = camera.unproject(corners[i]);
    if (!direction || direction->z() <= 0) return {};
    rays[i] = direction->head<2>() / direction->z();
  }
  const double focal_px = (camera.fx + camera.fy) / 2;
  std::vector<SquarePose> starts = solve_square(rays, tag.size_m);
  const std::size_t minima = starts.size();
  if (minima == 1) {
    // Noise can merge both minima of four corners; the whole print may still have two.
    const Isometry3d other = mirrored(starts[0].T_camera_tag);
    starts.push_back({other, square_error(other, rays, tag.size_m)});
  }
  const std::vector<SeenPixel> pixels =
      seen_pixels(*frame.color, response, camera, region_of_corners(corners, finder.pattern(), camera));
  const std::vector<SeenPixel> few = thinned(pixels);
  std::vector<Candidate> result;
  for (std::size_t i = 0; i < starts.size(); ++i) {
    const SquarePose& start = starts[i];
    // Four corners alone settle it where one pose misses them by pixels.
    if (i > 0 && (start.error - starts[0].error) * focal_px > 1.5) break;
    Candidate candidate;
    candidate.T_camera_tag = start.T_camera_tag;
    candidate.error_px = start.error * focal_px;
    // A corner is found to about a tenth of a pixel; its share in the pose grows with distance over size.
    const double distance_m = start.T_camera_tag.translation().norm();
    candidate.angle_sigma_rad = 0.1 / focal_px * distance_m / tag.size_m;
    candidate.position_sigma_m = candidate.angle_sigma_rad * distance_m;
    // A share of the pixels brings a pose near to where all of them would, and tells most wrong ones.
    align(candidate, rays, few);
    if (!candidate.alignment && few.size() < pixels.size()) align(candidate, rays, pixels);
    if (!candidate.alignment && i >= minima) break;  // a mirror image that is no minimum explains nothing
    result.push_back(candidate);
  }
  if (result.size() == 2) {
    // What depth has to say is not worth asking for where the rest outvotes it.
    const std::vector<double> cost = costs(result, frame);
    if (std::abs(cost[0] - cost[1]) > kCap) result.erase(result.begin() + (cost[0] > cost[1] ? 0 : 1));
  }
  for (Candidate& candidate : result)
    if (candidate.alignment) align(candidate, rays, pixels);
  if (result.size() == 2 && angle_between(result[0].T_camera_tag, result[1].T_camera_tag) < 0.1 * kDegree)
    result.pop_back();
  return result;
}

std::vector<double> PoseStage::State::costs(const std::vector<Candidate>& poses, const FrameSet& frame) const {
  double best_contrast = std::numeric_limits<double>::max();
  for (const Candidate& pose : poses)
    if (pose.alignment) best_contrast = std::min(best_contrast, pose.alignment->contrast_error);
  std::vector<double> result;
  for (const Candidate& pose : poses) {
    double cost = std::min(kCap, std::pow(pose.error_px / 0.2, 2));
    if (best_contrast < std::numeric_limits<double>::max()) {
      const double ratio = pose.alignment ? pose.alignment->contrast_error / best_contrast : 10;
      const double independent = pose.alignment ? pose.alignment->pixels / 10.0 : 10;
      cost += std::min(kCap, independent * (ratio * ratio - 1));
    }
    if (recent(frame)) {
      const double passed_s = 1e-9 * static_cast<double>(frame.time_ns - last->time_ns);
      const double angle = angle_between(pose.T_camera_tag, last->T_tag_camera_raw.inverse());
      cost += std::min(kCap, std::pow(angle / ((2 + 60 * passed_s) * kDegree), 2));
    }
    result.push_back(cost);
  }
  return result;
}

std::size_t PoseStage::State::choose(const std::vector<Candidate>& poses, const TagCorners& corners,
                                     const FrameSet& frame, std::vector<std::string>& warnings) const {
  if (poses.size() == 1) return 0;
  std::vector<double> cost = costs(poses, frame);
  if (const auto plane = frame.depth ? plane_inside(frame.depth->depth_m, camera, corners) : std::nullopt)
    for (std::size_t i = 0; i < poses.size(); ++i) {
      const double cosine = std::clamp(plane->normal.dot(poses[i].T_camera_tag.linear().col(2)), -1.0, 1.0);
      cost[i] += std::min(kCap, std::pow(std::acos(cosine) / (2 * plane->angle_sigma_rad), 2));
    }
  const std::size_t best = cost[0] <= cost[1] ? 0 : 1;
  if (std::abs(cost[0] - cost[1]) < 2)
    warnings.push_back(format("tag: two poses %.1f degrees apart explain it equally well",
                              angle_between(poses[0].T_camera_tag, poses[1].T_camera_tag) / kDegree));
  return best;
}

bool PoseStage::State::measure(const FrameSet& frame, std::vector<std::string>& warnings) {
  if (!frame.color) return false;
  const std::vector<TagCorners> sightings = find(frame);
  if (sightings.empty()) return false;
  if (sightings.size() > 1)
    warnings.push_back(format("tag: seen %.0f times, the surest is used", static_cast<double>(sightings.size())));
  const TagCorners& corners = sightings.front();
  const std::vector<Candidate> poses = candidates(corners, frame);
  if (poses.empty()) return false;
  const Candidate& chosen = poses[choose(poses, corners, frame, warnings)];
  if (!chosen.alignment) warnings.push_back("tag: its print does not fit the picture, pose from its corners alone");

  if (last && (frame.time_ns < last->time_ns || frame.time_ns - last->time_ns > kAgeLimitNs)) filter.reset();
  Pose pose;
  pose.T_tag_camera_raw = chosen.T_camera_tag.inverse();
  pose.T_tag_camera = filter.update(chosen.T_camera_tag, chosen.position_sigma_m, chosen.angle_sigma_rad).inverse();
  pose.reprojection_error_px = chosen.error_px;
  pose.time_ns = frame.time_ns;
  last = pose;
  return true;
}

PoseStage::PoseStage(const Tag& tag, const CameraModel& color, const Response& response)
    : state_(std::make_unique<State>(tag, color, response)) {}

PoseStage::~PoseStage() = default;

PoseStage::Result PoseStage::locate(const FrameSet& frame) {
  Result result;
  if (state_->measure(frame, result.warnings)) {
    result.pose = state_->last;
    return result;
  }
  const auto& last = state_->last;
  if (!last || frame.time_ns < last->time_ns) {
    result.warnings.push_back("tag: not in the picture");
    return result;
  }
  const std::int64_t age_ns = frame.time_ns - last->time_ns;
  const double age_ms = 1e-6 * static_cast<double>(age_ns);
  if (age_ns > kAgeLimitNs) {
    result.warnings.push_back(format("tag: not in the picture for %.0f ms, beyond the age limit of a pose", age_ms));
    return result;
  }
  result.warnings.push_back(format("tag: not in the picture, pose is %.0f ms old", age_ms));
  result.pose = last;
  result.pose->age_ns = age_ns;
  return result;
}

void PoseStage::reset() {
  state_->filter.reset();
  state_->last.reset();
}

}  // namespace lumigraft
