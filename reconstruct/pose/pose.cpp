#include "reconstruct/pose/pose.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <utility>

#include "reconstruct/pose/depth_plane.h"
#include "reconstruct/pose/depth_tracking.h"
#include "reconstruct/pose/filter.h"
#include "reconstruct/pose/gray_regions.h"
#include "reconstruct/pose/multi_tag_pose.h"
#include "reconstruct/pose/tag.h"
#include "reconstruct/pose/tag_map.h"
#include "reconstruct/pose/tag_pose_estimator.h"
#include "reconstruct/pose/tag_search.h"
#include "reconstruct/pose/tag_size_check.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector2d;

/// What depth errs by from frame to frame, as a share of all it errs by.
constexpr double kSurfaceJitter = 1.0 / 3;
/// While tags are tracked the whole picture is looked at once a second, for those that nobody expects; more often
/// while one has no place yet, or is hidden.
constexpr std::int64_t kLookAroundNs = 1'000'000'000, kLookOftenNs = 250'000'000;
constexpr int kFirstSizeChecks = 8, kSizeCheckEvery = 8;  // frames
/// A print that is this much less sure than it was is blurred or covered in part: for so long surfaces may be surer.
constexpr double kUnsharp = 2;
constexpr std::int64_t kUnsharpNs = 2'000'000'000;
constexpr double kAgree = 25;     // squared σ in six directions, within which a tag and surfaces mean the same pose
constexpr double kDoubt = 2;      // squared σ, below which two explanations are as good
constexpr double kMostCut = 0.9;  // of the pixels on a tag's edges

/// One of the tags that are looked for.
struct KnownTag {
  int id;
  TagPoseEstimator reader;
  TagSizeCheck size_check;
  std::optional<PrintAppearance> look{};  ///< when it was last seen
  std::size_t at_once = 1;                ///< how many of it were seen when the whole picture was last looked at
};

}  // namespace

struct PoseStage::State {
  State(const capture::Tag& tag, const capture::CameraModel& camera_in, const capture::Response& response)
      : camera(camera_in), search(tag, camera_in), carry(camera_in) {
    places.emplace_back();
    tags.push_back({tag.id, TagPoseEstimator(search.pattern(0), tag.size_m, camera, response), {tag.id, tag.size_m}});
    for (const capture::ExtraTag& also : tag.extra) {
      places.emplace_back(also.T_tag_extra);
      tags.push_back({also.id,
                      TagPoseEstimator(search.pattern(tags.size()), also.size_m, camera, response),
                      {also.id, also.size_m}});
    }
  }

  bool recent(const capture::FrameSet& frame) const;
  bool homeless() const;
  std::optional<Isometry3d> expected(std::size_t tag) const;
  std::vector<TagSighting> find(const capture::FrameSet& frame);
  std::vector<TagSighting> find_expected(const capture::FrameSet& frame);
  std::vector<TagSighting> look_around(const capture::FrameSet& frame);
  std::vector<TagReading> read(const capture::FrameSet& frame);
  void check_size(const capture::FrameSet& frame, const TagReading& reading, const PoseCandidate& candidate);
  void learn_places(const std::vector<TagReading>& readings, const MultiTagPose& pose);
  bool measure(const capture::FrameSet& frame, const DistanceField* field, std::vector<std::string>& warnings);
  bool carry_on(const capture::FrameSet& frame, const DistanceField& field);
  bool surer_by_surface(const capture::FrameSet& frame, const DistanceField& field, const MultiTagPose& tag);
  void follow_surface(const capture::FrameSet& frame, const PoseEstimate& carried);
  void warn_of_tags(std::vector<std::string>& warnings) const;

  capture::CameraModel camera;
  TagSearch search;
  std::vector<KnownTag> tags;       ///< the first is the world
  std::vector<TagMapEntry> places;  ///< of each
  PoseFilter filter;
  DepthTracking carry;
  std::optional<Pose> last;
  std::int64_t seen_ns = 0;  ///< when a tag was last seen
  std::optional<std::int64_t> looked_around_ns;
  int measured = 0;           ///< frames with a tag
  double sharp_sigma_m = 0;   ///< how sure the tag was of late while it was sharp
  std::int64_t sharp_ns = 0;  ///< and until when
};

bool PoseStage::State::recent(const capture::FrameSet& frame) const {
  return last && frame.time_ns > last->time_ns && frame.time_ns - last->time_ns <= kAgeLimitNs;
}

/// Whether some tag has no place yet.
bool PoseStage::State::homeless() const {
  return std::any_of(places.begin(), places.end(), [](const TagMapEntry& place) { return !place.T_world_tag(); });
}

/// Where the camera that hardly moved sees a tag.
std::optional<Isometry3d> PoseStage::State::expected(std::size_t tag) const {
  const auto& T_world_tag = places[tag].T_world_tag();
  if (!last || !T_world_tag) return std::nullopt;
  return last->T_tag_camera_raw.inverse() * *T_world_tag;
}

/// Each tag where it was.
std::vector<TagSighting> PoseStage::State::find_expected(const capture::FrameSet& frame) {
  std::vector<TagSighting> found;
  for (std::size_t t = 0; t < tags.size(); ++t) {
    const auto T_camera_tag = expected(t);
    const auto place = T_camera_tag ? tags[t].reader.place(*T_camera_tag) : std::nullopt;
    if (!place) continue;
    for (const TagSighting& sighting : search.in_region(*frame.color, place->region, place->narrowest_px, tags[t].id))
      found.push_back(sighting);
  }
  return found;
}

/// The whole picture.
std::vector<TagSighting> PoseStage::State::look_around(const capture::FrameSet& frame) {
  looked_around_ns = frame.time_ns;
  const bool tracked = recent(frame) && last->from == Pose::From::tag;
  std::vector<TagSighting> found = search.everywhere(*frame.color, !tracked     ? TagSearch::Depth::half_then_full
                                                                   : homeless() ? TagSearch::Depth::full
                                                                                : TagSearch::Depth::half);
  for (KnownTag& tag : tags)
    tag.at_once = static_cast<std::size_t>(
        std::count_if(found.begin(), found.end(), [&](const TagSighting& s) { return s.id == tag.id; }));
  return found;
}

std::vector<TagSighting> PoseStage::State::find(const capture::FrameSet& frame) {
  if (!search.fits(*frame.color)) return {};
  if (!recent(frame) || !looked_around_ns || frame.time_ns < *looked_around_ns) return look_around(frame);

  std::vector<TagSighting> found = find_expected(frame);
  const bool carried = last->from == Pose::From::surface;
  std::int64_t rest_ns = kLookAroundNs;
  if (homeless() || found.empty()) rest_ns = kLookOftenNs;
  if (found.empty() && !carried) rest_ns = 0;
  if (frame.time_ns - *looked_around_ns < rest_ns) return found;
  for (const TagSighting& sighting : look_around(frame)) {
    const bool known = std::any_of(found.begin(), found.end(), [&](const TagSighting& s) {
      return s.id == sighting.id && (centre_of(s.corners) - centre_of(sighting.corners)).norm() < 8;
    });
    if (!known) found.push_back(sighting);
  }
  return found;
}

/// What each tag in the picture says. Of two with one number, that which is nearest to where it was.
std::vector<TagReading> PoseStage::State::read(const capture::FrameSet& frame) {
  const std::vector<TagSighting> sightings = find(frame);
  const bool tracked = recent(frame);
  std::vector<TagReading> readings;
  for (std::size_t t = 0; t < tags.size(); ++t) {
    PoseHints hints;
    if (tracked) hints.T_camera_tag_before = expected(t);
    if (tracked) hints.passed_s = 1e-9 * static_cast<double>(frame.time_ns - last->time_ns);
    if (frame.depth) hints.depth_m = &frame.depth->depth_m;
    std::optional<Vector2d> where;
    if (hints.T_camera_tag_before) where = camera.project(hints.T_camera_tag_before->translation());
    const TagSighting* nearest = nullptr;
    for (const TagSighting& sighting : sightings) {
      if (sighting.id != tags[t].id) continue;
      if (!nearest ||
          (where && (centre_of(sighting.corners) - *where).norm() < (centre_of(nearest->corners) - *where).norm()))
        nearest = &sighting;
    }
    if (!nearest) continue;
    TagReading reading{t, tags[t].reader.explain(nearest->corners, *frame.color, hints), nearest->corners};
    if (!reading.candidates.empty()) readings.push_back(std::move(reading));
  }
  if (!readings.empty() || !tracked) return readings;
  // No square is whole: a hand on its rim, or a blur. What shows of a print may still be enough.
  for (std::size_t t = 0; t < tags.size(); ++t) {
    const auto T_camera_tag = expected(t);
    if (!T_camera_tag || !tags[t].look) continue;
    if (auto candidate = tags[t].reader.follow(*frame.color, *T_camera_tag, *tags[t].look))
      readings.push_back({t, {std::move(*candidate)}});
  }
  return readings;
}

/// Now and then, for it costs as much as all the tag's pixels.
void PoseStage::State::check_size(const capture::FrameSet& frame, const TagReading& reading,
                                  const PoseCandidate& candidate) {
  if (!frame.depth || !reading.corners || (measured > kFirstSizeChecks && measured % kSizeCheckEvery != 0)) return;
  if (const auto plane = plane_inside(frame.depth->depth_m, camera, *reading.corners))
    tags[reading.tag].size_check.see(*plane, candidate.T_camera_tag);
}

/// Tags beside the first get their places from pictures that show both.
void PoseStage::State::learn_places(const std::vector<TagReading>& readings, const MultiTagPose& pose) {
  if (readings.empty() || readings.front().tag != 0) return;
  const Isometry3d T_world_camera = readings.front().candidates[pose.choice.front()].T_camera_tag.inverse();
  for (std::size_t r = 1; r < readings.size(); ++r) {
    const std::vector<PoseCandidate>& candidates = readings[r].candidates;
    TagMapEntry& place = places[readings[r].tag];
    // One without a place has nothing to choose by but itself.
    if (!place.T_world_tag() && candidates.size() > 1 && std::abs(candidates[0].cost - candidates[1].cost) < 20)
      continue;
    const bool second = !place.T_world_tag() && candidates.size() > 1 && candidates[1].cost < candidates[0].cost;
    place.see(T_world_camera * candidates[second ? 1 : pose.choice[r]].T_camera_tag);
  }
}

void PoseStage::State::warn_of_tags(std::vector<std::string>& warnings) const {
  for (std::size_t t = 0; t < tags.size(); ++t) {
    if (tags[t].at_once > 1)
      warnings.push_back("tag " + std::to_string(tags[t].id) + ": seen " + std::to_string(tags[t].at_once) +
                         " times at once, one of them is used");
    for (std::string text : {tags[t].size_check.warning(), places[t].warning(tags[t].id)})
      if (!text.empty()) warnings.push_back(std::move(text));
  }
}

bool PoseStage::State::measure(const capture::FrameSet& frame, const DistanceField* field,
                               std::vector<std::string>& warnings) {
  if (!frame.color) return false;
  const std::vector<TagReading> readings = read(frame);
  const auto chosen = pose_of_tags(readings, places);
  if (!chosen) return false;
  if (last && !recent(frame)) {
    filter.reset();
    carry.reset();
  }
  ++measured;
  for (std::size_t r = 0; r < readings.size(); ++r) {
    const PoseCandidate& candidate = readings[r].candidates[chosen->choice[r]];
    if (candidate.alignment) tags[readings[r].tag].look = candidate.alignment->look;
    if (candidate.alignment && candidate.alignment->cut_share > kMostCut)
      warnings.push_back("tag " + std::to_string(tags[readings[r].tag].id) +
                         ": its paper is far too bright for the picture, the pose is less sure");
    check_size(frame, readings[r], candidate);
  }
  learn_places(readings, *chosen);
  if (chosen->rival < kDoubt) warnings.push_back("tag: two poses explain it equally well");
  if (!chosen->printed) warnings.push_back("tag: its print does not fit the picture, pose from its corners alone");
  for (const std::size_t tag : chosen->apart)
    warnings.push_back("tag " + std::to_string(tags[tag].id) + ": contradicts the others, left out");

  seen_ns = frame.time_ns;
  if (field && recent(frame) && surer_by_surface(frame, *field, *chosen)) {
    warnings.push_back("tag: its print is unsharp or covered in part, surfaces carry the pose");
    return true;
  }
  const double sigma_m = position_sigma_m(chosen->noise);
  sharp_sigma_m = measured == 1 ? sigma_m : 0.8 * sharp_sigma_m + 0.2 * sigma_m;
  sharp_ns = frame.time_ns;

  Pose pose;
  pose.T_tag_camera_raw = chosen->T_tag_camera;
  const Isometry3d used = carry.seen(frame, {chosen->T_tag_camera, chosen->noise + chosen->bias}, field);
  pose.T_tag_camera = filter.update(used.inverse(), chosen->position_sigma_m, chosen->angle_sigma_rad).inverse();
  carry.shown(pose.T_tag_camera);
  pose.covariance = chosen->noise / filter.count() + chosen->bias;
  pose.reprojection_error_px = chosen->error_px;
  pose.time_ns = frame.time_ns;
  last = pose;
  return true;
}

/// Follows the surface where that is surer than an unsharp tag, and does not contradict it.
bool PoseStage::State::surer_by_surface(const capture::FrameSet& frame, const DistanceField& field,
                                        const MultiTagPose& tag) {
  if (position_sigma_m(tag.noise) < kUnsharp * sharp_sigma_m || frame.time_ns - sharp_ns > kUnsharpNs) return false;
  const auto carried = carry.hidden(frame, field);
  const PoseCovariance of_tag = tag.noise + tag.bias;
  if (!carried || position_sigma_m(carried->covariance) > position_sigma_m(of_tag)) return false;
  const Eigen::Matrix<double, 6, 1> apart = step_between(carried->T_tag_camera, tag.T_tag_camera);
  if (squared_mahalanobis(apart, of_tag + carried->covariance) > kAgree) return false;
  follow_surface(frame, *carried);
  return true;
}

/// No tag shows; the room's surface does.
bool PoseStage::State::carry_on(const capture::FrameSet& frame, const DistanceField& field) {
  if (!recent(frame)) return false;
  const auto carried = carry.hidden(frame, field);
  if (carried) follow_surface(frame, *carried);
  return carried.has_value();
}

void PoseStage::State::follow_surface(const capture::FrameSet& frame, const PoseEstimate& carried) {
  const double position_m = kSurfaceJitter * position_sigma_m(carried.covariance);
  const double angle_rad = kSurfaceJitter * angle_sigma_rad(carried.covariance);
  Pose pose;
  pose.from = Pose::From::surface;
  pose.T_tag_camera_raw = carried.T_tag_camera;
  pose.T_tag_camera = filter.update(carried.T_tag_camera.inverse(), position_m, angle_rad).inverse();
  pose.covariance = carried.covariance + carry.covariance_at_start();
  pose.time_ns = frame.time_ns;
  pose.age_ns = frame.time_ns - seen_ns;
  last = pose;
}

PoseStage::PoseStage(const capture::Tag& tag, const capture::CameraModel& color, const capture::Response& response)
    : state_(std::make_unique<State>(tag, color, response)) {}

PoseStage::~PoseStage() = default;

PoseStage::Result PoseStage::locate(const capture::FrameSet& frame, const DistanceField* field) {
  Result result;
  const bool measured = state_->measure(frame, field, result.warnings);
  state_->warn_of_tags(result.warnings);
  const auto& last = state_->last;
  if (measured) {
    result.pose = last;
    return result;
  }
  if (!last || frame.time_ns < last->time_ns) {
    result.warnings.push_back("tag: not in the picture");
    return result;
  }
  const std::int64_t unseen_ns = frame.time_ns - state_->seen_ns;
  if (field && state_->carry_on(frame, *field)) {
    result.pose = last;
    result.warnings.push_back("tag: not in the picture, surfaces carry the pose");
    return result;
  }
  const std::int64_t age_ns = frame.time_ns - last->time_ns;
  if (age_ns > kAgeLimitNs) {
    result.warnings.push_back("tag: not in the picture, its pose is too old to use");
    return result;
  }
  result.warnings.push_back("tag: not in the picture, the pose is an old one");
  result.pose = last;
  result.pose->from = Pose::From::past;
  result.pose->covariance = DepthTracking::after(last->covariance, 1e-9 * static_cast<double>(age_ns));
  result.pose->age_ns = unseen_ns;
  return result;
}

void PoseStage::reset() {
  state_->filter.reset();
  state_->carry.reset();
  state_->last.reset();
  state_->looked_around_ns.reset();
}

}  // namespace lumigraft::reconstruct
