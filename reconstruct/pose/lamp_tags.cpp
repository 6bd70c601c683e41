#include "reconstruct/pose/lamp_tags.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <utility>

#include "reconstruct/pose/depth_plane.h"
#include "reconstruct/pose/filter.h"
#include "reconstruct/pose/tag_pose_estimator.h"
#include "reconstruct/pose/tag_search.h"
#include "reconstruct/pose/tag_size_check.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector2d;
using Eigen::Vector3d;

/// The whole picture is searched at full resolution, since tags on lamps are small: now and then for those that nobody
/// expects, more often while one is hidden, and at once where one that was seen a moment ago is not where it was.
constexpr std::int64_t kLookAroundNs = 2'000'000'000, kLookOftenNs = 500'000'000, kMomentNs = 300'000'000;
constexpr std::int64_t kFollowedNs = 1'000'000'000;  ///< for so long a hidden tag is looked for where it was
constexpr double kHand_m = 0.004;                    ///< 1σ of where a hand measures that a lamp is on its tag
constexpr double kScale = 0.005;                     ///< 1σ of the distance, by which lens and print err
constexpr double kDrift_mps = 0.01;                  ///< by which a lamp's place gets less sure while its tag is hidden
constexpr double kDoubt = 2;                         ///< squared σ, below which two explanations of a tag are as good,
constexpr double kApart_m = 0.015;                   ///< and so far apart they may then put the lamp

struct Track {
  const capture::TaggedLamp& lamp;
  TagPoseEstimator reader;
  TagSizeCheck size_check;
  PoseFilter filter = {};
  std::optional<Isometry3d> T_room_tag = {};  ///< as last seen; empty: not known
  std::int64_t seen_ns = 0;                   ///< and when
  Vector3d position_m = Vector3d::Zero();     ///< of the lamp
  Vector3d normal = Vector3d::Zero();
  double sigma_m = 0;
  bool lost = false;        ///< was known, and then hidden for too long
  bool in_picture = false;  ///< used in this one
  bool doubtful = false;    ///< and in it, but two poses explain it
  std::size_t at_once = 1;  ///< how many of its number were seen when the whole picture was last looked at
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
  void read(Track& track, const std::vector<TagSighting>& sightings, const capture::FrameSet& frame, const Pose& pose);
  void warn(const Track& track, std::int64_t hidden_ns, std::vector<std::string>& warnings) const;

  const std::vector<capture::TaggedLamp> lamps;
  capture::CameraModel camera;
  TagSearch search;
  std::vector<Track> tracks;
  std::optional<std::int64_t> looked_around_ns;
};

/// Tags where they were, and all over the picture when that is due.
std::vector<TagSighting> LampTagStage::State::find(const capture::FrameSet& frame, const Isometry3d& T_camera_room) {
  std::vector<TagSighting> found;
  std::int64_t rest_ns = kLookAroundNs;
  for (const Track& track : tracks) {
    const std::size_t before = found.size();
    const std::int64_t hidden_ns = frame.time_ns - track.seen_ns;
    const bool followed = track.T_room_tag && hidden_ns < kFollowedNs;
    if (const auto place = followed ? track.reader.place(T_camera_room * *track.T_room_tag) : std::nullopt)
      for (TagSighting& sighting :
           search.in_region(*frame.color, place->region, place->narrowest_px, track.lamp.tag_id))
        found.push_back(std::move(sighting));
    if (found.size() == before) rest_ns = std::min(rest_ns, followed && hidden_ns < kMomentNs ? 0 : kLookOftenNs);
  }
  if (looked_around_ns && frame.time_ns >= *looked_around_ns && frame.time_ns - *looked_around_ns < rest_ns)
    return found;
  looked_around_ns = frame.time_ns;
  const std::vector<TagSighting> all = search.everywhere(*frame.color, TagSearch::Depth::full);
  for (const TagSighting& sighting : all) {
    const bool known = std::any_of(found.begin(), found.end(), [&](const TagSighting& s) {
      return s.id == sighting.id && (centre_of(s.corners) - centre_of(sighting.corners)).norm() < 8;
    });
    if (!known) found.push_back(sighting);
  }
  for (Track& track : tracks)
    track.at_once = static_cast<std::size_t>(
        std::count_if(found.begin(), found.end(), [&](const TagSighting& s) { return s.id == track.lamp.tag_id; }));
  return found;
}

void LampTagStage::State::read(Track& track, const std::vector<TagSighting>& sightings, const capture::FrameSet& frame,
                               const Pose& pose) {
  PoseHints hints;
  std::optional<Vector2d> where;
  if (track.T_room_tag) {
    const Isometry3d T_camera_tag = pose.T_tag_camera.inverse() * *track.T_room_tag;
    where = camera.project(T_camera_tag.translation());
    if (frame.time_ns - track.seen_ns < kFollowedNs) {
      hints.T_camera_tag_before = T_camera_tag;
      hints.passed_s = 1e-9 * static_cast<double>(frame.time_ns - track.seen_ns);
    }
  }
  if (frame.depth) hints.depth_m = &frame.depth->depth_m;
  const TagSighting* nearest = nullptr;
  int count = 0;
  for (const TagSighting& sighting : sightings) {
    if (sighting.id != track.lamp.tag_id) continue;
    ++count;
    if (!nearest ||
        (where && (centre_of(sighting.corners) - *where).norm() < (centre_of(nearest->corners) - *where).norm()))
      nearest = &sighting;
  }
  if (!nearest || (count > 1 && !where)) return;
  const std::vector<PoseCandidate> candidates = track.reader.explain(nearest->corners, *frame.color, hints);
  if (candidates.empty()) return;
  const PoseCandidate& best =
      *std::min_element(candidates.begin(), candidates.end(),
                        [](const PoseCandidate& a, const PoseCandidate& b) { return a.cost < b.cost; });
  double spread_m = 0;  // of what explains the tag as well
  for (const PoseCandidate& other : candidates)
    if (other.cost - best.cost < kDoubt)
      spread_m = std::max(
          spread_m, (best.T_camera_tag * track.lamp.position_m - other.T_camera_tag * track.lamp.position_m).norm());
  if (frame.depth) {
    if (const auto plane = plane_inside(frame.depth->depth_m, camera, nearest->corners))
      track.size_check.see(*plane, best.T_camera_tag);
  }
  if (spread_m > kApart_m) {
    track.doubtful = true;
    return;
  }
  // What is new in every picture, and what is the same in all of them.
  const double distance_m = best.T_camera_tag.translation().norm();
  const double turn_rad = angle_sigma_rad(pose.covariance);
  const double noise_m = std::hypot(best.position_sigma_m, position_sigma_m(pose.covariance), turn_rad * distance_m);
  const double noise_rad = std::max(std::hypot(best.angle_sigma_rad, turn_rad), 1e-6);
  const Isometry3d T_room_tag = pose.T_tag_camera * best.T_camera_tag;
  const Isometry3d mean = track.filter.update(T_room_tag, std::max(noise_m, 1e-6), noise_rad);
  const double of_mean =
      std::hypot(noise_m, noise_rad * track.lamp.position_m.norm()) / std::sqrt(track.filter.count());
  track.position_m = mean * track.lamp.position_m;
  if (track.lamp.normal) track.normal = mean.linear() * *track.lamp.normal;
  track.sigma_m = std::hypot(std::hypot(of_mean, spread_m), kHand_m, kScale * distance_m);
  track.T_room_tag = T_room_tag;
  track.seen_ns = frame.time_ns;
  track.lost = false;
  track.in_picture = true;
}

void LampTagStage::State::warn(const Track& track, std::int64_t hidden_ns, std::vector<std::string>& warnings) const {
  const std::string lamp = "lamp " + track.lamp.name + ": ";
  const std::string tag = "tag " + std::to_string(track.lamp.tag_id);
  if (track.at_once > 1)
    warnings.push_back(lamp + tag + " is seen " + std::to_string(track.at_once) + " times at once, " +
                       (track.T_room_tag ? "the one nearest to where it was is used" : "none of them is used"));
  if (const std::string size = track.size_check.warning(); !size.empty())
    warnings.push_back(lamp + size + ": not used");
  else if (track.doubtful)
    warnings.push_back(lamp + "two poses explain its tag equally well");
  if (track.in_picture) return;
  if (track.T_room_tag && hidden_ns > 0)
    warnings.push_back(lamp + "its tag is hidden, it is taken where it was");
  else if (track.lost)
    warnings.push_back(lamp + "its tag has been hidden for too long, it is placed as lamps without one are");
  else if (track.at_once <= 1)
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
    track.in_picture = track.doubtful = false;
    const bool back = frame.time_ns < track.seen_ns;  // a recording that starts again
    if (track.T_room_tag && (back || frame.time_ns - track.seen_ns > kHeldNs)) {
      track.T_room_tag.reset();
      track.filter.reset();
      track.lost = !back;
    }
  }
  if (frame.color && s.search.fits(*frame.color) && pose && pose->from != Pose::From::past) {
    const std::vector<TagSighting> sightings = s.find(frame, pose->T_tag_camera.inverse());
    for (Track& track : s.tracks) s.read(track, sightings, frame, *pose);
  }
  for (std::size_t i = 0; i < s.tracks.size(); ++i) {
    const Track& track = s.tracks[i];
    const std::int64_t hidden_ns = frame.time_ns - track.seen_ns;
    s.warn(track, hidden_ns, result.warnings);
    if (!track.T_room_tag || !track.size_check.warning().empty()) continue;
    const double drift_m = kDrift_mps * 1e-9 * static_cast<double>(hidden_ns);
    result.marks.push_back({static_cast<int>(i), track.position_m.cast<float>(),
                            static_cast<float>(std::hypot(track.sigma_m, drift_m)), track.normal.cast<float>()});
  }
  return result;
}

}  // namespace lumigraft::reconstruct
