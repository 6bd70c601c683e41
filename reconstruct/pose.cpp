#include "reconstruct/pose.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

#include "reconstruct/pose_alignment.h"
#include "reconstruct/pose_filter.h"
#include "reconstruct/pose_plane.h"
#include "reconstruct/pose_solver.h"
#include "reconstruct/pose_tag.h"

namespace lumigraft {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

constexpr double kDegree = M_PI / 180;

/// Linear light, one channel, and the same as 8 bits for the detector.
struct Grey {
  Image<float> linear;
  Image<std::uint8_t> codes;
};

Grey grey_of(const Picture& picture, const Response& response) {
  constexpr float kRed = 0.2126f, kGreen = 0.7152f, kBlue = 0.0722f;  // Rec. 709 luminance
  Grey grey;
  if (!picture.encoded.empty()) {
    const auto& in = picture.encoded;
    grey.linear = Image<float>(in.width, in.height, 1);
    grey.codes = Image<std::uint8_t>(in.width, in.height, 1);
    for (std::size_t i = 0; i < grey.codes.data.size(); ++i) {
      const std::uint8_t* rgb = &in.data[3 * i];
      grey.codes.data[i] = static_cast<std::uint8_t>((54 * rgb[0] + 183 * rgb[1] + 19 * rgb[2]) >> 8);
      grey.linear.data[i] = kRed * response.to_linear(rgb[0], 0) + kGreen * response.to_linear(rgb[1], 1) +
                            kBlue * response.to_linear(rgb[2], 2);
    }
    return grey;
  }
  const auto& in = picture.radiance;
  grey.linear = Image<float>(in.width, in.height, 1);
  grey.codes = Image<std::uint8_t>(in.width, in.height, 1);
  for (std::size_t i = 0; i < grey.linear.data.size(); ++i)
    grey.linear.data[i] = kRed * in.data[3 * i] + kGreen * in.data[3 * i + 1] + kBlue * in.data[3 * i + 2];
  std::vector<float> sorted = grey.linear.data;
  const auto bright = sorted.begin() + static_cast<std::ptrdiff_t>(sorted.size() * 95 / 100);
  if (bright == sorted.end()) return grey;
  std::nth_element(sorted.begin(), bright, sorted.end());
  const float scale = *bright > 0 ? 0.9f / *bright : 1.0f;
  for (std::size_t i = 0; i < grey.linear.data.size(); ++i)
    grey.codes.data[i] = static_cast<std::uint8_t>(std::lround(255 * linear_to_srgb(scale * grey.linear.data[i])));
  return grey;
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

  std::vector<Candidate> candidates(const TagCorners& corners, const Grey& grey) const;
  std::size_t choose(const std::vector<Candidate>& poses, const TagCorners& corners, const FrameSet& frame,
                     std::vector<std::string>& warnings) const;
  bool measure(const FrameSet& frame, std::vector<std::string>& warnings);

  Tag tag;
  CameraModel camera;
  Response response;
  TagFinder finder;
  PoseFilter filter;
  std::optional<Pose> last;
};

std::vector<Candidate> PoseStage::State::candidates(const TagCorners& corners, const Grey& grey) const {
  SquareCorners rays;
  for (int i = 0; i < 4; ++i) {
    const auto direction = camera.unproject(corners[i]);
    if (!direction || direction->z() <= 0) return {};
    rays[i] = direction->head<2>() / direction->z();
  }
  const double pixels = (camera.fx + camera.fy) / 2;
  std::vector<SquarePose> starts = solve_square(rays, tag.size_m);
  const std::size_t minima = starts.size();
  if (minima == 1) {
    // Noise can merge both minima of four corners; the whole print may still have two.
    const Isometry3d other = mirrored(starts[0].T_camera_tag);
    starts.push_back({other, square_error(other, rays, tag.size_m)});
  }
  std::vector<Candidate> result;
  for (std::size_t i = 0; i < starts.size(); ++i) {
    const SquarePose& start = starts[i];
    // Four corners alone settle it where one pose misses them by pixels.
    if (i > 0 && (start.error - starts[0].error) * pixels > 1.5) break;
    Candidate candidate;
    candidate.T_camera_tag = start.T_camera_tag;
    candidate.error_px = start.error * pixels;
    // A corner is found to about a tenth of a pixel; its share in the pose grows with distance over size.
    const double distance_m = start.T_camera_tag.translation().norm();
    candidate.angle_sigma_rad = 0.1 / pixels * distance_m / tag.size_m;
    candidate.position_sigma_m = candidate.angle_sigma_rad * distance_m;
    candidate.alignment = align_to_print(grey.linear, camera, finder.pattern(), tag.size_m, start.T_camera_tag);
    if (candidate.alignment) {
      candidate.T_camera_tag = candidate.alignment->T_camera_tag;
      candidate.error_px = square_error(candidate.T_camera_tag, rays, tag.size_m) * pixels;
      // The residuals call noise independent from pixel to pixel; measured errors are three times as large.
      candidate.position_sigma_m = std::max(3 * candidate.alignment->position_sigma_m, 1e-5);
      candidate.angle_sigma_rad = std::max(3 * candidate.alignment->angle_sigma_rad, 1e-5);
    } else if (i >= minima) {
      break;  // a mirror image that is no minimum explains nothing
    }
    result.push_back(candidate);
  }
  if (result.size() == 2 && angle_between(result[0].T_camera_tag, result[1].T_camera_tag) < 0.1 * kDegree)
    result.pop_back();
  return result;
}

std::size_t PoseStage::State::choose(const std::vector<Candidate>& poses, const TagCorners& corners,
                                     const FrameSet& frame, std::vector<std::string>& warnings) const {
  if (poses.size() == 1) return 0;
  const auto plane = frame.depth ? plane_inside(frame.depth->depth_m, camera, corners) : std::nullopt;
  double best_contrast = std::numeric_limits<double>::max();
  for (const Candidate& pose : poses)
    if (pose.alignment) best_contrast = std::min(best_contrast, pose.alignment->contrast_error);

  // Each term is a squared deviation in σ, capped so that no single witness outvotes the others for good.
  constexpr double kCap = 100;
  std::vector<double> costs;
  for (const Candidate& pose : poses) {
    double cost = std::min(kCap, std::pow(pose.error_px / 0.2, 2));
    if (best_contrast < std::numeric_limits<double>::max()) {
      const double ratio = pose.alignment ? pose.alignment->contrast_error / best_contrast : 10;
      const double independent = pose.alignment ? pose.alignment->pixels / 10.0 : 10;
      cost += std::min(kCap, independent * (ratio * ratio - 1));
    }
    if (last && frame.time_ns > last->time_ns && frame.time_ns - last->time_ns <= kAgeLimitNs) {
      const double passed_s = 1e-9 * static_cast<double>(frame.time_ns - last->time_ns);
      const double angle = angle_between(pose.T_camera_tag, last->T_tag_camera_raw.inverse());
      cost += std::min(kCap, std::pow(angle / ((2 + 60 * passed_s) * kDegree), 2));
    }
    if (plane) {
      const double cosine = std::clamp(plane->normal.dot(pose.T_camera_tag.linear().col(2)), -1.0, 1.0);
      cost += std::min(kCap, std::pow(std::acos(cosine) / (2 * plane->angle_sigma_rad), 2));
    }
    costs.push_back(cost);
  }
  const std::size_t best = costs[0] <= costs[1] ? 0 : 1;
  if (std::abs(costs[0] - costs[1]) < 2)
    warnings.push_back(format("tag: two poses %.1f degrees apart explain it equally well",
                              angle_between(poses[0].T_camera_tag, poses[1].T_camera_tag) / kDegree));
  return best;
}

bool PoseStage::State::measure(const FrameSet& frame, std::vector<std::string>& warnings) {
  if (!frame.color) return false;
  const Grey grey = grey_of(*frame.color, response);
  if (grey.codes.empty()) return false;
  const std::vector<TagCorners> sightings = finder.find(grey.codes);
  if (sightings.empty()) return false;
  if (sightings.size() > 1)
    warnings.push_back(format("tag: seen %.0f times, the surest is used", static_cast<double>(sightings.size())));
  const TagCorners& corners = sightings.front();
  const std::vector<Candidate> poses = candidates(corners, grey);
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
