#include "reconstruct/pose/lamp_tags.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <utility>

#include "reconstruct/pose/depth_plane.h"
#include "reconstruct/pose/filter.h"
#include "reconstruct/pose/tag_pose_estimator.h"
#include "reconstruct/pose/tag_search.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

struct Track {
  const capture::TaggedLamp& lamp;
  TagPoseEstimator estimator;
  TagSizeCheck size_check;
  PoseFilter filter = {};
  std::optional<Isometry3d> T_room_tag = {};  ///< as last seen; empty: unknown
  std::int64_t seen_ns = 0;                   ///< time of that
  Vector3d position_m = Vector3d::Zero();     ///< of the lamp
  Vector3d normal = Vector3d::Zero();
  double sigma_m = 0;
  bool lost = false;       ///< hidden for too long after it was known
  bool measured = false;   ///< in this frame
  bool ambiguous = false;  ///< in this frame: two poses explain it
  std::size_t copies = 1;  ///< sightings of its id in the last search of the whole image
};

capture::Tag tags_of(const capture::Session& session) {
  capture::Tag tag;
  tag.family = session.tag.family;
  tag.id = session.lamps.front().tag_id;
  for (std::size_t i = 1; i < session.lamps.size(); ++i)
    tag.extra.push_back({.id = session.lamps[i].tag_id, .size_m = session.lamps[i].tag_size_m, .T_tag_extra = {}});
  return tag;
}

}  // namespace

struct LampTagStage::State {
  explicit State(const capture::Session& session)
      : lamps(session.lamps), camera(session.color.model), search(tags_of(session), camera) {
    for (std::size_t i = 0; i < lamps.size(); ++i)
      tracks.push_back({lamps[i],
                        TagPoseEstimator(search.pattern(i), lamps[i].tag_size_m, camera, session.color.response),
                        {lamps[i].tag_id, lamps[i].tag_size_m}});
  }
  State(const State&) = delete;  // tracks refer to lamps
  State& operator=(const State&) = delete;

  std::vector<TagSighting> find(const capture::FrameSet& frame, const Isometry3d& T_camera_room);
  void measure(Track& track, const std::vector<TagSighting>& sightings, const capture::FrameSet& frame,
               const Pose& pose);
  void warn(const Track& track, std::int64_t hidden_ns, std::vector<std::string>& warnings) const;

  const std::vector<capture::TaggedLamp> lamps;
  capture::CameraModel camera;
  TagSearch search;
  std::vector<Track> tracks;
  std::optional<std::int64_t> searched_ns;
};

/// Searches tags at their last positions, and in the whole image when that is due.
std::vector<TagSighting> LampTagStage::State::find(const capture::FrameSet& frame, const Isometry3d& T_camera_room) {
  std::vector<TagSighting> found;
  std::int64_t interval_ns = kLampTags.interval_ns;
  for (const Track& track : tracks) {
    const std::size_t before = found.size();
    const std::int64_t hidden_ns = frame.time_ns - track.seen_ns;
    const bool expected = track.T_room_tag && hidden_ns < kLampTags.expected_ns;
    if (const auto region = expected ? track.estimator.search_region(T_camera_room * *track.T_room_tag) : std::nullopt)
      for (TagSighting& sighting :
           search.in_region(*frame.color, region->pixels, region->narrowest_px, track.lamp.tag_id))
        found.push_back(std::move(sighting));
    if (found.size() == before)
      interval_ns =
          std::min(interval_ns, expected && hidden_ns < kLampTags.just_seen_ns ? 0 : kLampTags.short_interval_ns);
  }
  if (searched_ns && frame.time_ns >= *searched_ns && frame.time_ns - *searched_ns < interval_ns) return found;
  searched_ns = frame.time_ns;
  add_new_sightings(found, search.in_image(*frame.color, TagSearch::Resolution::full));
  for (Track& track : tracks) track.copies = count_sightings(found, track.lamp.tag_id);
  return found;
}

void LampTagStage::State::measure(Track& track, const std::vector<TagSighting>& sightings,
                                  const capture::FrameSet& frame, const Pose& pose) {
  PoseHints hints;
  std::optional<Vector2d> expected_px;
  if (track.T_room_tag) {
    const Isometry3d T_camera_tag = pose.T_tag_camera.inverse() * *track.T_room_tag;
    expected_px = camera.project(T_camera_tag.translation());
    if (frame.time_ns - track.seen_ns < kLampTags.expected_ns) {
      hints.T_camera_tag_before = T_camera_tag;
      hints.elapsed_s = 1e-9 * static_cast<double>(frame.time_ns - track.seen_ns);
    }
  }
  if (frame.depth) hints.depth_m = &frame.depth->depth_m;
  const TagSighting* nearest = nearest_sighting(sightings, track.lamp.tag_id, expected_px);
  if (!nearest || (!expected_px && count_sightings(sightings, track.lamp.tag_id) > 1)) return;
  const std::vector<PoseCandidate> candidates = track.estimator.estimate(nearest->corners, *frame.color, hints);
  if (candidates.empty()) return;
  const PoseCandidate& best =
      *std::min_element(candidates.begin(), candidates.end(),
                        [](const PoseCandidate& a, const PoseCandidate& b) { return a.cost < b.cost; });
  double spread_m = 0;  // of the lamp's position by candidates of similar cost
  for (const PoseCandidate& other : candidates)
    if (other.cost - best.cost < kLampTags.min_cost_gap)
      spread_m = std::max(
          spread_m, (best.T_camera_tag * track.lamp.position_m - other.T_camera_tag * track.lamp.position_m).norm());
  if (frame.depth) {
    if (const auto plane = plane_inside(frame.depth->depth_m, camera, nearest->corners))
      track.size_check.add(*plane, best.T_camera_tag);
  }
  if (spread_m > kLampTags.max_spread_m) {
    track.ambiguous = true;
    return;
  }
  // The noise of each frame averages out in the filter; the other terms do not.
  const double distance_m = best.T_camera_tag.translation().norm();
  const double camera_rad = angle_sigma_rad(pose.covariance);
  const double noise_m = std::hypot(best.position_sigma_m, position_sigma_m(pose.covariance), camera_rad * distance_m);
  const double noise_rad = std::max(std::hypot(best.angle_sigma_rad, camera_rad), 1e-6);
  const Isometry3d T_room_tag = pose.T_tag_camera * best.T_camera_tag;
  const Isometry3d mean = track.filter.update(T_room_tag, std::max(noise_m, 1e-6), noise_rad);
  const double mean_sigma_m =
      std::hypot(noise_m, noise_rad * track.lamp.position_m.norm()) / std::sqrt(track.filter.count());
  track.position_m = mean * track.lamp.position_m;
  if (track.lamp.normal) track.normal = mean.linear() * *track.lamp.normal;
  track.sigma_m =
      std::hypot(std::hypot(mean_sigma_m, spread_m), kLampTags.offset_sigma_m, kLampTags.scale_sigma * distance_m);
  track.T_room_tag = T_room_tag;
  track.seen_ns = frame.time_ns;
  track.lost = false;
  track.measured = true;
}

void LampTagStage::State::warn(const Track& track, std::int64_t hidden_ns, std::vector<std::string>& warnings) const {
  const std::string lamp = "lamp " + track.lamp.name + ": ";
  const std::string tag = "tag " + std::to_string(track.lamp.tag_id);
  if (track.copies > 1)
    warnings.push_back(lamp + tag + " is seen " + std::to_string(track.copies) + " times at once, " +
                       (track.T_room_tag ? "the one nearest to its last position is used" : "none of them is used"));
  if (const std::string size = track.size_check.warning(); !size.empty())
    warnings.push_back(lamp + size + ": not used");
  else if (track.ambiguous)
    warnings.push_back(lamp + "two poses explain its tag equally well");
  if (track.measured) return;
  if (track.T_room_tag && hidden_ns > 0)
    warnings.push_back(lamp + "its tag is hidden, its last position is used");
  else if (track.lost)
    warnings.push_back(lamp + "its tag has been hidden for too long, it is located like a lamp without a tag");
  else if (track.copies <= 1)
    warnings.push_back(lamp + tag + " has not been seen yet");
}

LampTagStage::LampTagStage(const capture::Session& session) {
  if (!session.lamps.empty()) state_ = std::make_unique<State>(session);
}

LampTagStage::~LampTagStage() = default;

LampTagStage::Result LampTagStage::locate(const capture::FrameSet& frame, const std::optional<Pose>& pose) {
  Result result;
  if (!state_) return result;
  State& s = *state_;
  for (Track& track : s.tracks) {
    track.measured = track.ambiguous = false;
    const bool restarted = frame.time_ns < track.seen_ns;  // of a recording
    if (track.T_room_tag && (restarted || frame.time_ns - track.seen_ns > kHeldNs)) {
      track.T_room_tag.reset();
      track.filter.reset();
      track.lost = !restarted;
    }
  }
  if (frame.color && s.search.fits(*frame.color) && pose && pose->from != Pose::From::past) {
    const std::vector<TagSighting> sightings = s.find(frame, pose->T_tag_camera.inverse());
    for (Track& track : s.tracks) s.measure(track, sightings, frame, *pose);
  }
  for (std::size_t i = 0; i < s.tracks.size(); ++i) {
    const Track& track = s.tracks[i];
    const std::int64_t hidden_ns = frame.time_ns - track.seen_ns;
    s.warn(track, hidden_ns, result.warnings);
    if (!track.T_room_tag || !track.size_check.warning().empty()) continue;
    const double drift_m = kLampTags.drift_mps * 1e-9 * static_cast<double>(hidden_ns);
    result.marks.push_back({static_cast<int>(i), track.position_m.cast<float>(),
                            static_cast<float>(std::hypot(track.sigma_m, drift_m)), track.normal.cast<float>()});
  }
  return result;
}

}  // namespace lumigraft::reconstruct
