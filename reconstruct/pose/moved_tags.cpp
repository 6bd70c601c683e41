#include "reconstruct/pose/moved_tags.h"

#include <algorithm>

#include "reconstruct/pose/parameters.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Isometry3d;
using Step = Eigen::Matrix<double, 6, 1>;

bool excludes(const PoseEstimate& known, const MultiTagPose& pose) {
  const PoseCovariance noise = known.covariance + pose.noise + pose.bias;
  return contradicts(step_between(known.T_tag_camera, pose.T_tag_camera), noise.diagonal().cwiseSqrt());
}

/// Whether two tags are elsewhere relative to each other than frames before showed them.
bool moved_apart(const TagReading& one, std::size_t choice_of_one, const TagReading& other, std::size_t choice_of_other,
                 const TagMap& map) {
  const bool in_order = one.tag < other.tag;
  const Isometry3d T_one_other =
      one.candidates[choice_of_one].T_camera_tag.inverse() * other.candidates[choice_of_other].T_camera_tag;
  return in_order ? map.contradicts_pair(one.tag, other.tag, T_one_other)
                  : map.contradicts_pair(other.tag, one.tag, T_one_other.inverse());
}

}  // namespace

std::optional<Isometry3d> MovedTags::place(std::size_t tag) const {
  return left_out_[tag] && places_[tag].frames > 0 ? std::optional(places_[tag].T_world_tag) : std::nullopt;
}

bool MovedTags::find(const std::vector<TagReading>& readings, const MultiTagPose& pose, const TagMap& map,
                     const std::function<std::optional<PoseEstimate>()>& by_depth) {
  std::vector<std::size_t> agreeing, contradicting;  // readings
  std::vector<bool> without_agreeing = left_out_;
  for (std::size_t r = 0; r < readings.size(); ++r) {
    const std::size_t tag = readings[r].tag;
    if (left_out_[tag] || !map.T_world_tag(tag)) continue;
    const bool agrees = std::ranges::find(pose.contradicting, tag) == pose.contradicting.end();
    (agrees ? agreeing : contradicting).push_back(r);
    if (agrees) without_agreeing[tag] = true;
  }
  if (contradicting.empty()) return false;
  const std::optional<MultiTagPose> other = pose_of_tags(readings, map, without_agreeing);
  if (!other) return false;
  const bool apart = std::ranges::any_of(agreeing, [&](std::size_t a) {
    return std::ranges::any_of(contradicting, [&](std::size_t b) {
      return moved_apart(readings[a], pose.choice[a], readings[b], other->choice[b], map);
    });
  });
  if (!apart) return false;

  std::optional<bool> agreeing_moved;
  if (agreeing.size() != contradicting.size()) agreeing_moved = agreeing.size() < contradicting.size();
  for (const bool at_rest : {true, false}) {
    if (agreeing_moved) break;
    const std::optional<PoseEstimate> known = at_rest ? agreed_ : by_depth();
    if (known && excludes(*known, pose) != excludes(*known, *other)) agreeing_moved = excludes(*known, pose);
  }
  if (!agreeing_moved) return false;
  for (const std::size_t r : *agreeing_moved ? agreeing : contradicting) left_out_[readings[r].tag] = true;
  return true;
}

void MovedTags::follow(const std::vector<TagReading>& readings, const MultiTagPose& pose, TagMap& map) {
  const auto agrees = [&](const TagReading& reading) {
    return map.T_world_tag(reading.tag) &&
           std::ranges::find(pose.contradicting, reading.tag) == pose.contradicting.end();
  };
  const bool all = std::ranges::all_of(pose.contradicting, [&](std::size_t tag) { return left_out_[tag]; });
  if (all && std::ranges::count_if(readings, agrees) > 1) agreed_ = {pose.T_tag_camera, pose.noise + pose.bias};
  for (std::size_t r = 0; r < readings.size(); ++r) {
    const std::size_t tag = readings[r].tag;
    if (!left_out_[tag]) continue;
    const PoseCandidate& candidate = readings[r].candidates[pose.choice[r]];
    const Isometry3d T_world_tag = pose.T_tag_camera * candidate.T_camera_tag;
    Place& place = places_[tag];
    if (place.frames > 0 && contradicts(step_between(place.T_world_tag, T_world_tag), Step::Zero())) place.frames = 0;
    if (place.frames++ == 0) place.T_world_tag = T_world_tag;
    const Step sigma = (candidate.noise + candidate.bias).diagonal().cwiseSqrt();
    if (!contradicts(step_between(*map.T_world_tag(tag), T_world_tag), sigma)) {
      use_again(tag);
    } else if (place.frames >= kTagMap.moved_sightings) {
      map.move(tag, T_world_tag);
      use_again(tag);
    }
  }
}

void MovedTags::use_again(std::size_t tag) {
  left_out_[tag] = false;
  places_[tag] = {};
}

void MovedTags::reset() {
  for (std::size_t tag = 0; tag < left_out_.size(); ++tag) use_again(tag);
  agreed_.reset();
}

}  // namespace lumigraft::reconstruct
