#include "reconstruct/pose/pose.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <utility>

#include "capture/message_text.h"
#include "reconstruct/pose/depth_plane.h"
#include "reconstruct/pose/depth_tracking.h"
#include "reconstruct/pose/filter.h"
#include "reconstruct/pose/keyframe_map.h"
#include "reconstruct/pose/moved_tags.h"
#include "reconstruct/pose/multi_tag_pose.h"
#include "reconstruct/pose/parameters.h"
#include "reconstruct/pose/rest_check.h"
#include "reconstruct/pose/rolling_shutter.h"
#include "reconstruct/pose/surface_anchor.h"
#include "reconstruct/pose/tag.h"
#include "reconstruct/pose/tag_pose_estimator.h"
#include "reconstruct/pose/tag_search.h"
#include "reconstruct/pose/tag_tilt.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Isometry3d;
using Eigen::Vector2d;

/// One of the room's tags.
struct KnownTag {
  int id;
  TagPoseEstimator estimator;
  TagSizeCheck size_check;
  TagTilt tilt;
  TagImageMotion motion{};
  std::optional<PrintAppearance> appearance{};  ///< when it was last seen
  std::size_t copies = 1;                       ///< sightings of its id in the last search of the whole image
};

}  // namespace

struct PoseStage::State {
  State(const capture::Tag& tag, const capture::CameraModel& camera_in, const capture::Response& response,
        const capture::DepthNoise& noise, const std::optional<double>& readout_s_in)
      : camera(camera_in),
        readout_s(readout_s_in),
        depth_noise(noise),
        search(tag, camera_in),
        tag_map(tag),
        moves_exhibit(tag.moves_exhibit),
        moved(tag.extra.size() + 1),
        tracking(camera_in, noise),
        rest_check(camera_in, noise),
        keyframes(camera_in, noise) {
    if (!tag.present()) return;
    const double focal_px = (camera.fx + camera.fy) / 2;
    tags.push_back({tag.id,
                    TagPoseEstimator(search.pattern(0), tag.size_m, camera, response),
                    {tag.id, tag.size_m},
                    TagTilt(tag.size_m, focal_px)});
    for (const capture::ExtraTag& extra : tag.extra) {
      tags.push_back({extra.id,
                      TagPoseEstimator(search.pattern(tags.size()), extra.size_m, camera, response),
                      {extra.id, extra.size_m},
                      TagTilt(extra.size_m, focal_px)});
    }
  }

  bool recent(const capture::FrameSet& frame) const;
  bool has_unlocated_tag() const;
  std::optional<Isometry3d> expected(std::size_t tag) const;
  std::vector<ImageMotion> follow_motion(const capture::FrameSet& frame,
                                         const std::vector<const TagSighting*>& sightings);
  std::vector<TagSighting> find(const capture::FrameSet& frame);
  std::vector<TagSighting> find_expected(const capture::FrameSet& frame);
  std::vector<TagSighting> search_image(const capture::FrameSet& frame);
  void search_mirrored(const capture::FrameSet& frame);
  void search_reflected(const capture::FrameSet& frame);
  std::vector<TagReading> read_tags(const capture::FrameSet& frame);
  std::vector<TagReading> follow_prints(const capture::FrameSet& frame, const std::vector<ImageMotion>& motions) const;
  void check_size(const capture::FrameSet& frame, const TagReading& reading, const PoseCandidate& candidate);
  void update_tag_map(const std::vector<TagReading>& readings, const std::optional<MultiTagPose>& pose);
  std::optional<MultiTagPose> choose_pose(const capture::FrameSet& frame, const DistanceField* field,
                                          const std::vector<TagReading>& readings);
  bool measure(const capture::FrameSet& frame, const DistanceField* field, std::vector<std::string>& warnings);
  bool track(const capture::FrameSet& frame, const DistanceField& field);
  bool track_unsharp(const capture::FrameSet& frame, const DistanceField& field, const MultiTagPose& tag);
  bool tag_was_moved(const capture::FrameSet& frame, const DistanceField& field, const TagReading& reading,
                     const MultiTagPose& tag);
  bool tag_crept(const capture::FrameSet& frame, const DistanceField& field, const MultiTagPose& tag);
  bool anchor(const capture::FrameSet& frame);
  bool relocate(const capture::FrameSet& frame, const DistanceField* field,
                const std::optional<PoseEstimate>& tracked = std::nullopt);
  void use_tracked(const capture::FrameSet& frame, const PoseEstimate& tracked, const PoseCovariance* noise = nullptr);
  void keep_view(const capture::FrameSet& frame);
  void confirm_views(const capture::FrameSet& frame);
  bool compare_now(const capture::FrameSet& frame);
  void add_tag_warnings(std::vector<std::string>& warnings) const;
  Isometry3d exhibit_place() const { return moves_exhibit ? *tag_map.T_world_tag(0) : Isometry3d::Identity(); }

  capture::CameraModel camera;
  std::optional<double> readout_s;  ///< that the session states
  capture::DepthNoise depth_noise;
  TagSearch search;
  std::vector<KnownTag> tags;  ///< the first defines the world frame; none: a surface does
  TagMap tag_map;
  bool moves_exhibit;
  MovedTags moved;
  std::uint64_t taken_map = 0;  ///< version of the map that was taken last
  PoseFilter filter;
  DepthTracking tracking;
  RestCheck rest_check;
  KeyframeMap keyframes;
  int unconfirmed_views = 0;  ///< searches left for restored views to agree with a tag
  int taken_views = 0;        ///< KeyframeMap::kept when they were taken last
  std::optional<Pose> last;
  std::int64_t read_ns = 0;                 ///< when the row of the tags' centre was exposed in this frame
  std::int64_t row_ns = 0;                  ///< when the row was exposed that `last` is for; if it is from a tag
  std::int64_t seen_ns = 0;                 ///< when a tag was last seen
  std::optional<std::int64_t> searched_ns;  ///< last search of the whole image
  std::optional<std::int64_t> mirror_searched_ns;
  std::vector<TagSighting> mirrored;  ///< tags that were seen mirrored in that search
  std::optional<std::int64_t> reflection_searched_ns;
  std::vector<TagSighting> reflected;            ///< tags that a mirror showed in that search
  std::optional<std::int64_t> compared_ns;       ///< last comparison with all kept views
  int measured = 0;                              ///< frames with a tag
  double sharp_sigma_m = 0;                      ///< running mean of the position's 1σ while the print was sharp
  std::int64_t sharp_ns = 0;                     ///< the last time it was
  int moved_alone = 0;                           ///< frames in a row in which the only tag had moved and rested there
  Isometry3d moved_to = Isometry3d::Identity();  ///< T_world_tag at the first of them
  bool crept = false;                            ///< it moved slowly: it may go on
};

bool PoseStage::State::recent(const capture::FrameSet& frame) const {
  return last && frame.time_ns > last->time_ns && frame.time_ns - last->time_ns <= kAgeLimitNs;
}

/// Whether the pose of some tag is not known yet.
bool PoseStage::State::has_unlocated_tag() const {
  for (std::size_t t = 0; t < tags.size(); ++t)
    if (!tag_map.T_world_tag(t)) return true;
  return false;
}

/// T_camera_tag if the camera has not moved since the last pose.
std::optional<Isometry3d> PoseStage::State::expected(std::size_t tag) const {
  const auto place = moved.place(tag);
  const auto& T_world_tag = place ? place : tag_map.T_world_tag(tag);
  if (!last || !T_world_tag) return std::nullopt;
  return last->T_tag_camera_raw.inverse() * *T_world_tag;
}

/// Searches each tag at its last position.
std::vector<TagSighting> PoseStage::State::find_expected(const capture::FrameSet& frame) {
  std::vector<TagSighting> found;
  for (std::size_t t = 0; t < tags.size(); ++t) {
    const auto T_camera_tag = expected(t);
    const auto region = T_camera_tag ? tags[t].estimator.search_region(*T_camera_tag) : std::nullopt;
    if (!region) continue;
    for (const TagSighting& sighting : search.in_region(*frame.color, region->pixels, region->narrowest_px, tags[t].id))
      found.push_back(sighting);
  }
  return found;
}

/// Searches the whole image.
std::vector<TagSighting> PoseStage::State::search_image(const capture::FrameSet& frame) {
  searched_ns = frame.time_ns;
  const bool tracked = recent(frame) && last->from == Pose::From::tag;
  std::vector<TagSighting> found = search.in_image(*frame.color, !tracked ? TagSearch::Resolution::half_then_full
                                                                 : has_unlocated_tag() ? TagSearch::Resolution::full
                                                                                       : TagSearch::Resolution::half);
  for (KnownTag& tag : tags) tag.copies = count_sightings(found, tag.id);
  return found;
}

std::vector<TagSighting> PoseStage::State::find(const capture::FrameSet& frame) {
  if (!search.fits(*frame.color)) return {};
  if (!recent(frame) || !searched_ns || frame.time_ns < *searched_ns) return search_image(frame);

  std::vector<TagSighting> found = find_expected(frame);
  const bool by_depth = last->from == Pose::From::surface;
  std::int64_t interval_ns = kTagSearch.interval_ns;
  if (has_unlocated_tag() || found.empty()) interval_ns = kTagSearch.short_interval_ns;
  if (found.empty() && !by_depth) interval_ns = 0;
  if (frame.time_ns - *searched_ns >= interval_ns) add_new_sightings(found, search_image(frame));
  return found;
}

/// While no tag is found, or one that was never located, it may be printed mirrored: its code is then another one.
void PoseStage::State::search_mirrored(const capture::FrameSet& frame) {
  if (!frame.color || !search.fits(*frame.color)) return;
  const bool seen = last && seen_ns == frame.time_ns;
  if (seen && !has_unlocated_tag()) {
    mirror_searched_ns = frame.time_ns;
    mirrored.clear();
    return;
  }
  if (!mirror_searched_ns || frame.time_ns < *mirror_searched_ns) mirror_searched_ns = frame.time_ns;
  if (frame.time_ns - *mirror_searched_ns < kTagSearch.mirrored_ns) return;
  mirror_searched_ns = frame.time_ns;
  mirrored = search.mirrored_in_image(*frame.color);
}

/// A tag that is seen as it is printed, and mirrored elsewhere in the image, shows a mirror.
void PoseStage::State::search_reflected(const capture::FrameSet& frame) {
  const bool seen = last && seen_ns == frame.time_ns;
  if (!seen || !frame.color || !search.fits(*frame.color) || has_unlocated_tag()) return;
  const bool recently = reflection_searched_ns && frame.time_ns >= *reflection_searched_ns &&
                        frame.time_ns - *reflection_searched_ns < kTagSearch.reflected_ns;
  if (recently) return;
  reflection_searched_ns = frame.time_ns;
  reflected = search.mirrored_in_image(*frame.color);
}

/// Motion of each tag's image, at the time of the row of the centre of all that are seen.
std::vector<ImageMotion> PoseStage::State::follow_motion(const capture::FrameSet& frame,
                                                         const std::vector<const TagSighting*>& sightings) {
  const RowTime row_time = RowTime::of(readout_s ? readout_s : frame.color->readout_s, camera.height);
  double row = 0, seen = 0;
  for (const TagSighting* sighting : sightings) {
    if (!sighting) continue;
    row += centre_of(sighting->corners).y();
    ++seen;
  }
  row = seen > 0 ? row / seen : (camera.height - 1) / 2.0;
  read_ns = frame.time_ns + std::llround(1e9 * row_time.seconds * row);
  const double focal_px = (camera.fx + camera.fy) / 2;
  std::vector<ImageMotion> motions;
  for (std::size_t t = 0; t < tags.size(); ++t) {
    std::optional<TagImageMotion::Expected> by_last;
    const auto T_camera_tag = recent(frame) ? expected(t) : std::nullopt;
    if (const auto corners =
            T_camera_tag ? tags[t].estimator.corners_at(tags[t].tilt.as_printed(*T_camera_tag)) : std::nullopt) {
      by_last = {*corners, row_ns};
      if (last->from != Pose::From::tag)
        by_last = {*corners, last->time_ns,
                   focal_px * (position_sigma_m(last->covariance) / T_camera_tag->translation().norm() +
                               angle_sigma_rad(last->covariance))};
    }
    motions.push_back(tags[t].motion.update(sightings[t] ? std::optional(sightings[t]->corners) : std::nullopt, by_last,
                                            row, read_ns, row_time, kRollingShutter.usual_rad_s * focal_px));
  }
  std::vector<bool> is_seen;
  for (const TagSighting* sighting : sightings) is_seen.push_back(sighting != nullptr);
  limit_to_common_motion(motions, is_seen);
  return motions;
}

/// Candidates from each tag in the image. Of several sightings of one id the nearest to the last position is used.
std::vector<TagReading> PoseStage::State::read_tags(const capture::FrameSet& frame) {
  const std::vector<TagSighting> sightings = find(frame);
  const bool tracked = recent(frame);
  std::vector<PoseHints> hints(tags.size());
  std::vector<const TagSighting*> nearest(tags.size());
  for (std::size_t t = 0; t < tags.size(); ++t) {
    if (const auto T_camera_tag = tracked ? expected(t) : std::nullopt)
      hints[t].T_camera_tag_before = tags[t].tilt.as_printed(*T_camera_tag);
    if (tracked) hints[t].elapsed_s = 1e-9 * static_cast<double>(frame.time_ns - last->time_ns);
    if (frame.depth) hints[t].depth_m = &frame.depth->depth_m;
    std::optional<Vector2d> expected_px;
    if (hints[t].T_camera_tag_before) expected_px = camera.project(hints[t].T_camera_tag_before->translation());
    nearest[t] = nearest_sighting(sightings, tags[t].id, expected_px);
  }
  const std::vector<ImageMotion> motions = follow_motion(frame, nearest);
  std::vector<TagReading> readings;
  for (std::size_t t = 0; t < tags.size(); ++t) {
    if (!nearest[t]) continue;
    hints[t].motion = motions[t];
    TagReading reading{t, tags[t].estimator.estimate(nearest[t]->corners, *frame.color, hints[t]), nearest[t]->corners};
    const auto surface =
        frame.depth ? plane_around(frame.depth->depth_m, camera, nearest[t]->corners, depth_noise) : std::nullopt;
    for (PoseCandidate& candidate : reading.candidates) tags[t].tilt.correct(candidate, surface);
    if (!reading.candidates.empty()) readings.push_back(std::move(reading));
  }
  if (readings.empty() && tracked) readings = follow_prints(frame, motions);
  return readings;
}

/// If no square was detected, for example since a hand covers its border: the visible part of a print may be enough.
std::vector<TagReading> PoseStage::State::follow_prints(const capture::FrameSet& frame,
                                                        const std::vector<ImageMotion>& motions) const {
  std::vector<TagReading> readings;
  for (std::size_t t = 0; t < tags.size(); ++t) {
    const auto T_camera_tag = expected(t);
    if (!T_camera_tag || !tags[t].appearance) continue;
    if (auto candidate = tags[t].estimator.follow(*frame.color, tags[t].tilt.as_printed(*T_camera_tag),
                                                  *tags[t].appearance, motions[t])) {
      tags[t].tilt.correct(*candidate, std::nullopt);
      readings.push_back({t, {std::move(*candidate)}});
    }
  }
  return readings;
}

/// Compares the tag's size with depth in some frames.
void PoseStage::State::check_size(const capture::FrameSet& frame, const TagReading& reading,
                                  const PoseCandidate& candidate) {
  if (!frame.depth || !reading.corners ||
      (measured > kPose.first_size_checks && measured % kPose.size_check_interval != 0))
    return;
  if (const auto plane = plane_inside(frame.depth->depth_m, camera, *reading.corners))
    tags[reading.tag].size_check.add(*plane, candidate.T_camera_tag);
}

/// Adds all pairs of tags in the frame, located or not. Of a tag that is not located its own candidates must decide.
void PoseStage::State::update_tag_map(const std::vector<TagReading>& readings,
                                      const std::optional<MultiTagPose>& pose) {
  std::vector<const PoseCandidate*> sure(readings.size());
  for (std::size_t r = 0; r < readings.size(); ++r) {
    const std::vector<PoseCandidate>& c = readings[r].candidates;
    if (pose && tag_map.T_world_tag(readings[r].tag))
      sure[r] = &c[pose->choice[r]];
    else if (c.size() == 1 || std::abs(c[0].cost - c[1].cost) >= kPose.min_map_cost_gap)
      sure[r] = &c[c.size() > 1 && c[1].cost < c[0].cost ? 1 : 0];
  }
  for (std::size_t r = 0; r < readings.size(); ++r)
    for (std::size_t q = r + 1; q < readings.size(); ++q)
      if (sure[r] && sure[q] && !moved.left_out()[readings[r].tag] && !moved.left_out()[readings[q].tag])
        tag_map.add_pair(readings[r].tag, readings[q].tag, sure[r]->T_camera_tag.inverse() * sure[q]->T_camera_tag);
}

void PoseStage::State::add_tag_warnings(std::vector<std::string>& warnings) const {
  for (const TagSighting& image : reflected) {
    const Vector2d at = centre_of(image.corners);
    warnings.push_back(capture::formatted(
        "a mirror shows tag %d at pixel (%.0f, %.0f): unless it is configured as a [[real_surface]], lamps that it "
        "shows are taken for real ones and light is wrong",
        image.id, at.x(), at.y()));
  }
  for (const TagSighting& image : mirrored)
    warnings.push_back("tag " + std::to_string(image.id) +
                       ": is seen mirrored, and not used: print it as it is, or keep " + "mirrors out of view");
  for (std::size_t t = 0; t < tags.size(); ++t) {
    if (tags[t].copies > 1)
      warnings.push_back("tag " + std::to_string(tags[t].id) + ": seen " + std::to_string(tags[t].copies) +
                         " times at once, one of them is used");
    for (std::string text : {tags[t].size_check.warning(), tags[t].tilt.warning(tags[t].id), tag_map.warning(t)})
      if (!text.empty()) warnings.push_back(std::move(text));
  }
}

/// Pose from those tags that were not moved.
std::optional<MultiTagPose> PoseStage::State::choose_pose(const capture::FrameSet& frame, const DistanceField* field,
                                                          const std::vector<TagReading>& readings) {
  if (!recent(frame)) {
    moved.reset();
    rest_check.reset();
    return pose_of_tags(readings, tag_map);
  }
  const auto chosen = pose_of_tags(readings, tag_map, moved.left_out());
  const auto by_depth = [&]() -> std::optional<PoseEstimate> {
    DepthTracking unchanged = tracking;
    return field ? unchanged.track(frame, *field) : std::nullopt;
  };
  if (!chosen || !moved.find(readings, *chosen, tag_map, by_depth)) return chosen;
  return pose_of_tags(readings, tag_map, moved.left_out());
}

/// Pose from the tags in the frame. False if none is visible.
bool PoseStage::State::measure(const capture::FrameSet& frame, const DistanceField* field,
                               std::vector<std::string>& warnings) {
  if (!frame.color || tags.empty()) return false;
  const std::vector<TagReading> readings = read_tags(frame);
  const auto chosen = choose_pose(frame, field, readings);
  update_tag_map(readings, chosen);
  if (!chosen) return false;
  moved.follow(readings, *chosen, tag_map);
  if (last && !recent(frame)) {
    filter.reset();
    tracking.reset();
  }
  ++measured;
  double blur_px = 0, blur_pixels = 0;
  for (std::size_t r = 0; r < readings.size(); ++r) {
    const PoseCandidate& candidate = readings[r].candidates[chosen->choice[r]];
    tags[readings[r].tag].tilt.add(candidate);
    if (candidate.alignment) {
      tags[readings[r].tag].appearance = candidate.alignment->appearance;
      if (candidate.alignment->clipped_fraction < kPose.max_clipped_blur) {
        blur_px += candidate.alignment->pixels * candidate.alignment->appearance.blur;
        blur_pixels += candidate.alignment->pixels;
      }
    }
    if (candidate.alignment && candidate.alignment->clipped_fraction > kPose.max_clipped)
      warnings.push_back("tag " + std::to_string(tags[readings[r].tag].id) +
                         ": its paper is overexposed, the pose is less certain");
    check_size(frame, readings[r], candidate);
  }
  if (chosen->cost_gap < kPose.min_cost_gap) warnings.push_back("tag: two poses explain it equally well");
  if (!chosen->printed) warnings.push_back("tag: its print does not fit the picture, pose from its corners alone");
  for (const std::size_t tag : chosen->contradicting)
    warnings.push_back("tag " + std::to_string(tags[tag].id) + ": contradicts the others, left out");

  seen_ns = frame.time_ns;
  if (field && recent(frame) && readings.size() == 1 && tag_was_moved(frame, *field, readings.front(), *chosen)) {
    warnings.push_back("tag: it moves and the room does not, the pose is tracked by depth");
    return true;
  }
  if (field && recent(frame) && readings.size() == 1 && tag_crept(frame, *field, *chosen)) {
    warnings.push_back("tag: it moves and the room does not, the pose is tracked by depth");
    return true;
  }
  if (field && recent(frame) && track_unsharp(frame, *field, *chosen)) {
    warnings.push_back("tag: its print is blurred or partly covered, the pose is tracked by depth");
    return true;
  }
  const double sigma_m = position_sigma_m(chosen->noise);
  sharp_sigma_m = measured == 1 ? sigma_m : kPose.sharp_old * sharp_sigma_m + kPose.sharp_new * sigma_m;
  sharp_ns = frame.time_ns;

  Pose pose;
  pose.T_tag_exhibit = exhibit_place();
  pose.T_tag_camera_raw = chosen->T_tag_camera;
  const Isometry3d used = tracking.tag_seen(frame, {chosen->T_tag_camera, chosen->noise + chosen->bias}, field);
  pose.T_tag_camera = filter.update(used.inverse(), chosen->position_sigma_m, chosen->angle_sigma_rad).inverse();
  tracking.set_displayed(pose.T_tag_camera);
  pose.covariance = chosen->noise / filter.count() + chosen->bias;
  pose.reprojection_error_px = chosen->error_px;
  if (blur_pixels > 0) pose.blur_px = blur_px / blur_pixels;
  pose.time_ns = frame.time_ns;
  last = pose;
  row_ns = read_ns;
  confirm_views(frame);
  keep_view(frame);
  return true;
}

/// Uses depth if the print is unsharp, depth is more certain, and both agree.
bool PoseStage::State::track_unsharp(const capture::FrameSet& frame, const DistanceField& field,
                                     const MultiTagPose& tag) {
  if (position_sigma_m(tag.noise) < kPose.unsharp * sharp_sigma_m || frame.time_ns - sharp_ns > kPose.unsharp_ns)
    return false;
  const auto tracked = tracking.track(frame, field);
  const PoseCovariance of_tag = tag.noise + tag.bias;
  if (!tracked || position_sigma_m(tracked->covariance) > position_sigma_m(of_tag)) return false;
  const Eigen::Matrix<double, 6, 1> difference = step_between(tracked->T_tag_camera, tag.T_tag_camera);
  if (squared_mahalanobis(difference, of_tag + tracked->covariance) > kPose.max_disagreement) return false;
  use_tracked(frame, *tracked);
  return true;
}

/// Uses depth if the tag jumped and the camera rests. After some frames the tag is known at its new place.
bool PoseStage::State::tag_was_moved(const capture::FrameSet& frame, const DistanceField& field,
                                     const TagReading& reading, const MultiTagPose& tag) {
  using Step = Eigen::Matrix<double, 6, 1>;
  const int before = std::exchange(moved_alone, 0);
  // The print's bias is the same before and after, and in the pose from which depth tracks.
  const Step noise = tag.noise.diagonal().cwiseSqrt();
  if (!contradicts(step_between(last->T_tag_camera, tag.T_tag_camera), noise)) return false;
  if (!frame.depth || surface_shows_motion(tracking.points_of(frame), field, tag.T_tag_camera, last->T_tag_camera))
    return false;
  DepthTracking by_depth = tracking;  // unchanged if the tag is right
  const auto tracked = by_depth.track(frame, field);
  if (!tracked) return false;
  const double elapsed_s = 1e-9 * static_cast<double>(frame.time_ns - last->time_ns);
  if (!tag_moved_alone({tag.T_tag_camera, tag.noise}, *tracked, last->T_tag_camera,
                       DepthTracking::predicted(last->covariance, elapsed_s)))
    return false;
  tracking = std::move(by_depth);
  const Isometry3d T_world_tag = tracked->T_tag_camera * reading.candidates[tag.choice.front()].T_camera_tag;
  moved_alone = before > 0 && contradicts(step_between(moved_to, T_world_tag), Step::Zero()) ? 1 : before + 1;
  if (moved_alone == 1) moved_to = T_world_tag;
  if (moved_alone == (crept ? kTagMap.moved_sightings : kTagMap.moved_alone)) {
    tag_map.move(reading.tag, T_world_tag);
    crept = false;
  }
  use_tracked(frame, *tracked);
  return true;
}

/// Goes on from the pose that depth gives if the tag moved slowly while the camera rests.
bool PoseStage::State::tag_crept(const capture::FrameSet& frame, const DistanceField& field, const MultiTagPose& tag) {
  const auto rested = rest_check.tag_crept(frame, {tag.T_tag_camera, tag.noise}, field);
  if (!rested) return false;
  crept = true;
  tracking.reset();
  tracking.tag_seen(frame, *rested, nullptr);
  tracking.set_displayed(rested->T_tag_camera);
  use_tracked(frame, *rested);
  return true;
}

/// Pose from depth in a frame without a tag. False if there is none.
bool PoseStage::State::track(const capture::FrameSet& frame, const DistanceField& field) {
  if (!recent(frame)) return false;
  const auto tracked = tracking.track(frame, field);
  const bool uncertain = tracked && position_sigma_m(tracked->covariance) > kKeyframes.max_sigma_m;
  if (uncertain && relocate(frame, &field, tracked)) return true;
  if (tracked) use_tracked(frame, *tracked);
  return tracked.has_value();
}

/// `noise`: what differs from frame to frame; null: a fraction of the covariance.
void PoseStage::State::use_tracked(const capture::FrameSet& frame, const PoseEstimate& tracked,
                                   const PoseCovariance* noise) {
  if (tags.empty()) seen_ns = frame.time_ns;  // the surface itself is the world
  double position_m = kPose.surface_jitter * position_sigma_m(tracked.covariance);
  double angle_rad = kPose.surface_jitter * angle_sigma_rad(tracked.covariance);
  if (noise) {
    position_m = std::min(position_m, position_sigma_m(*noise));
    angle_rad = std::min(angle_rad, angle_sigma_rad(*noise));
  }
  Pose pose;
  pose.T_tag_exhibit = exhibit_place();
  pose.from = Pose::From::surface;
  pose.T_tag_camera_raw = tracked.T_tag_camera;
  pose.T_tag_camera = filter.update(tracked.T_tag_camera.inverse(), position_m, angle_rad).inverse();
  pose.covariance = tracked.covariance + tracking.covariance_at_start();
  pose.time_ns = frame.time_ns;
  pose.age_ns = frame.time_ns - seen_ns;
  last = pose;
  keep_view(frame);
}

/// The first pose of a room without a tag. False if there is one, or depth shows no surface.
bool PoseStage::State::anchor(const capture::FrameSet& frame) {
  if (!tags.empty() || last || !keyframes.empty() || !frame.depth) return false;
  const auto pose = anchored_on_surface(tracking.points_of(frame));
  if (!pose || !tracking.restart(frame, *pose, nullptr)) return false;
  use_tracked(frame, *pose);
  return true;
}

/// Pose from kept views of the room, aligned to the surface where it is known. `tracked`: by depth, which leaves it
/// uncertain. False if no view agrees.
bool PoseStage::State::relocate(const capture::FrameSet& frame, const DistanceField* field,
                                const std::optional<PoseEstimate>& tracked) {
  if (!frame.color || !search.fits(*frame.color) || keyframes.empty()) return false;
  if (unconfirmed_views > 0 && measured > 0) return false;  // the tag may have been moved since they were kept
  std::optional<PoseEstimate> expected = tracked;
  if (!tracked && recent(frame)) {
    expected = {last->T_tag_camera_raw,
                tracking.held(last->covariance, 1e-9 * static_cast<double>(frame.time_ns - last->time_ns))};
  } else if (!tracked) {
    if (!compare_now(frame)) return false;
  }
  const auto found = keyframes.locate(*frame.color, expected);
  const auto pose = found ? tracking.restart(frame, found->pose, field) : std::nullopt;
  if (!pose) return false;
  if (!expected) filter.reset();
  use_tracked(frame, *pose, &found->noise);
  return true;
}

/// Whether a comparison with all views is due.
bool PoseStage::State::compare_now(const capture::FrameSet& frame) {
  if (compared_ns && frame.time_ns >= *compared_ns && frame.time_ns - *compared_ns < kKeyframes.interval_ns)
    return false;
  compared_ns = frame.time_ns;
  return true;
}

/// Compares views that were restored with the first poses from a tag, and drops them if they are of another world.
void PoseStage::State::confirm_views(const capture::FrameSet& frame) {
  if (unconfirmed_views == 0 || !compare_now(frame)) return;
  --unconfirmed_views;
  const auto found = keyframes.locate(*frame.color);
  const bool agree =
      found && squared_mahalanobis(step_between(found->pose.T_tag_camera, last->T_tag_camera_raw),
                                   found->pose.covariance + last->covariance) < kKeyframes.max_disagreement;
  if (found ? !agree : unconfirmed_views == 0) keyframes.restore({});
  if (found) unconfirmed_views = 0;
}

void PoseStage::State::keep_view(const capture::FrameSet& frame) {
  if (unconfirmed_views > 0 && measured > 0) return;
  if (position_sigma_m(last->covariance) < kDepthTracking.max_sigma_m)
    keyframes.add(frame, {last->T_tag_camera_raw, last->covariance});
}

PoseStage::PoseStage(const capture::Tag& tag, const capture::CameraModel& color, const capture::Response& response,
                     const capture::DepthNoise& noise, const std::optional<double>& readout_s)
    : state_(std::make_unique<State>(tag, color, response, noise, readout_s)) {}

PoseStage::~PoseStage() = default;

PoseStage::Result PoseStage::locate(const capture::FrameSet& frame, const DistanceField* field) {
  Result result;
  State& s = *state_;
  const bool has_tag = !s.tags.empty();
  const auto warn = [&](const std::string& text) {
    result.warnings.push_back(has_tag ? "tag: not in the picture" + text : "camera" + text);
  };
  const bool measured = s.measure(frame, field, result.warnings);
  s.search_mirrored(frame);
  s.search_reflected(frame);
  s.add_tag_warnings(result.warnings);
  if (measured) {
    result.pose = s.last;
    return result;
  }
  if (field && s.track(frame, *field)) {
    result.pose = s.last;
    if (has_tag) warn(", the pose is tracked by depth");
    return result;
  }
  if (s.relocate(frame, field) || s.anchor(frame)) {
    result.pose = s.last;
    if (has_tag) warn(", the pose is found by earlier views of the room");
    return result;
  }
  if (!s.last || frame.time_ns < s.last->time_ns) {
    warn(has_tag ? "" : ": not located, neither depth nor earlier views show the room");
    return result;
  }
  const std::int64_t age_ns = frame.time_ns - s.last->time_ns;
  if (age_ns > kAgeLimitNs) {
    warn(has_tag ? ", its pose is too old to use" : ": lost, neither depth nor earlier views show where it is");
    return result;
  }
  warn(has_tag ? ", the pose is an old one"
               : ": neither depth nor earlier views show where it is, its pose is an old one");
  result.pose = s.last;
  result.pose->from = Pose::From::past;
  result.pose->covariance = s.tracking.held(s.last->covariance, 1e-9 * static_cast<double>(age_ns));
  result.pose->age_ns = frame.time_ns - s.seen_ns;
  return result;
}

void PoseStage::reset() {
  state_->filter.reset();
  state_->tracking.reset();
  state_->last.reset();
  state_->searched_ns.reset();
}

void PoseStage::restore_views(KeyframeMap::Views views) {
  state_->unconfirmed_views = views.empty() ? 0 : kKeyframes.confirmations;
  state_->keyframes.restore(std::move(views));
}

std::optional<KeyframeMap::Views> PoseStage::take_views() {
  const KeyframeMap& map = state_->keyframes;
  if (std::exchange(state_->taken_views, map.kept()) == map.kept()) return std::nullopt;
  return map.views();
}

void PoseStage::restore_tag_map(TagMap::State learnt) { state_->tag_map.restore(std::move(learnt)); }

std::optional<TagMap::State> PoseStage::take_tag_map() {
  const TagMap& map = state_->tag_map;
  if (state_->tags.size() < 2 || std::exchange(state_->taken_map, map.version()) == map.version()) return std::nullopt;
  return map.state();
}

}  // namespace lumigraft::reconstruct
