#include "reconstruct/pose/multi_tag_pose.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>

#include "reconstruct/pose/parameters.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Isometry3d;

/// A candidate as a pose of the camera in the world.
struct EvidenceTerm {
  Isometry3d T_world_camera;
  PoseCovariance noise, bias;
  const PoseCandidate* candidate;
};

PoseCovariance rotated(const PoseCovariance& covariance, const Eigen::Matrix3d& rotation) {
  PoseCovariance both = PoseCovariance::Zero();
  both.topLeftCorner<3, 3>() = both.bottomRightCorner<3, 3>() = rotation;
  return both * covariance * both.transpose();
}

EvidenceTerm evidence_of(const PoseCandidate& candidate, const TagMap& map, std::size_t tag) {
  const Isometry3d& T_world_tag = *map.T_world_tag(tag);
  return {T_world_tag * candidate.T_camera_tag.inverse(), rotated(candidate.noise, T_world_tag.linear()),
          rotated(candidate.bias, T_world_tag.linear()) + map.uncertainty(tag, candidate.T_camera_tag), &candidate};
}

/// Squared Mahalanobis distance.
double distance(const EvidenceTerm& a, const EvidenceTerm& b) {
  const Eigen::Matrix<double, 6, 1> step = step_between(a.T_world_camera, b.T_world_camera);
  return squared_mahalanobis(step, a.noise + a.bias + b.noise + b.bias);
}

/// Mean weighted by information. `result.noise` is the part that averages out over time.
void average(const std::vector<EvidenceTerm>& evidence_terms, MultiTagPose& result) {
  PoseCovariance information = PoseCovariance::Zero();
  Eigen::Matrix<double, 6, 1> sum = Eigen::Matrix<double, 6, 1>::Zero();
  std::vector<PoseCovariance> weights;
  for (const EvidenceTerm& evidence : evidence_terms) {
    weights.push_back(information_of(evidence.noise + evidence.bias));
    information += weights.back();
    sum += weights.back() * step_between(result.T_tag_camera, evidence.T_world_camera);
  }
  const PoseCovariance covariance = information_of(information);
  result.T_tag_camera = apply_step(result.T_tag_camera, covariance * sum);
  result.noise.setZero();
  for (std::size_t i = 0; i < evidence_terms.size(); ++i) {
    const PoseCovariance gain = covariance * weights[i];
    result.noise += gain * evidence_terms[i].noise * gain.transpose();
  }
  result.bias = covariance - result.noise;
}

}  // namespace

std::optional<MultiTagPose> pose_of_tags(const std::vector<TagReading>& readings, const TagMap& tag_map,
                                         const std::vector<bool>& left_out) {
  const auto is_left_out = [&](std::size_t tag) { return tag < left_out.size() && left_out[tag]; };
  std::vector<std::vector<EvidenceTerm>> evidence_terms(readings.size());
  bool first_seen = false;
  for (std::size_t r = 0; r < readings.size(); ++r) {
    if (!tag_map.T_world_tag(readings[r].tag)) continue;
    first_seen |= readings[r].tag == 0 && !is_left_out(0);
    for (const PoseCandidate& candidate : readings[r].candidates)
      evidence_terms[r].push_back(evidence_of(candidate, tag_map, readings[r].tag));
  }
  // The candidate of a reading that has the least evidence against it from all others.
  MultiTagPose result;
  double best = std::numeric_limits<double>::max();
  std::size_t base = 0;
  for (std::size_t r = 0; r < readings.size(); ++r) {
    if ((first_seen && readings[r].tag != 0) || is_left_out(readings[r].tag)) continue;
    for (std::size_t c = 0; c < evidence_terms[r].size(); ++c) {
      double cost = evidence_terms[r][c].candidate->cost;
      std::vector<std::size_t> choice(readings.size(), 0);
      choice[r] = c;
      for (std::size_t q = 0; q < readings.size(); ++q) {
        if (q == r) continue;
        double min_cost = std::numeric_limits<double>::max();
        for (std::size_t d = 0; d < evidence_terms[q].size(); ++d) {
          const double cost_against =
              evidence_terms[q][d].candidate->cost +
              std::min(kTagPose.evidence_cap, distance(evidence_terms[r][c], evidence_terms[q][d]));
          if (cost_against >= min_cost) continue;
          min_cost = cost_against;
          choice[q] = d;
        }
        if (!evidence_terms[q].empty()) cost += min_cost;
      }
      if (cost >= best) continue;
      best = cost;
      base = r;
      result.choice = std::move(choice);
    }
  }
  if (result.choice.empty()) return std::nullopt;

  const EvidenceTerm& chosen = evidence_terms[base][result.choice[base]];
  // The additional cost of the other candidate of the same reading.
  result.cost_gap = std::numeric_limits<double>::max();
  for (const EvidenceTerm& other : evidence_terms[base]) {
    if (&other == &chosen) continue;
    double cost = other.candidate->cost - chosen.candidate->cost;
    for (std::size_t q = 0; q < readings.size(); ++q)
      if (q != base && !evidence_terms[q].empty()) {
        const EvidenceTerm& agreed = evidence_terms[q][result.choice[q]];
        cost += std::min(kTagPose.evidence_cap, distance(other, agreed)) -
                std::min(kTagPose.evidence_cap, distance(chosen, agreed));
      }
    result.cost_gap = cost;
  }
  result.T_tag_camera = chosen.T_world_camera;
  result.noise = chosen.noise;
  result.bias = chosen.bias;
  result.position_sigma_m = chosen.candidate->position_sigma_m;
  result.angle_sigma_rad = chosen.candidate->angle_sigma_rad;
  result.error_px = chosen.candidate->error_px;
  result.printed = chosen.candidate->alignment.has_value();
  std::vector<EvidenceTerm> agreeing;
  for (std::size_t r = 0; r < readings.size(); ++r) {
    if (evidence_terms[r].empty()) continue;
    const EvidenceTerm& evidence = evidence_terms[r][result.choice[r]];
    if (r != base && (is_left_out(readings[r].tag) || distance(chosen, evidence) > kTagPose.tag_disagreement)) {
      result.contradicting.push_back(readings[r].tag);
      continue;
    }
    agreeing.push_back(evidence);
  }
  if (agreeing.size() > 1) average(agreeing, result);
  return result;
}

}  // namespace lumigraft::reconstruct
