#include "reconstruct/pose/multi_tag_pose.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>

#include "capture/message_text.h"
#include "reconstruct/pose/parameters.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Isometry3d;

using Step = Eigen::Matrix<double, 6, 1>;

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

EvidenceTerm evidence_of(const PoseCandidate& candidate, const TagMapEntry& entry) {
  const Isometry3d& T_world_tag = *entry.T_world_tag();
  return {T_world_tag * candidate.T_camera_tag.inverse(), rotated(candidate.noise, T_world_tag.linear()),
          rotated(candidate.bias + entry.uncertainty(candidate.T_camera_tag), T_world_tag.linear()), &candidate};
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

bool contradicts(const Step& step, const Step& sigma) {
  return step.head<3>().norm() > kTagMap.moved_m + kTagMap.moved_sigmas * sigma.head<3>().norm() ||
         step.tail<3>().norm() > kTagMap.moved_rad + kTagMap.moved_sigmas * sigma.tail<3>().norm();
}

void TagMapEntry::move(const Isometry3d& T_world_tag) {
  moved_m_ += (T_world_tag.translation() - T_world_tag_->translation()).norm();
  T_world_tag_ = mean_ = T_world_tag;
  squares_.setZero();
  count_ = contradicting_ = 0;
}

PoseCovariance TagMapEntry::uncertainty(const Isometry3d& T_camera_tag) const {
  PoseCovariance of_tag = PoseCovariance::Zero();  // rotation, translation
  if (first_) return of_tag;
  double position_sigma_m = kTagMap.configured_sigma_m, angle_sigma_rad = kTagMap.configured_sigma_rad;
  if (count_ >= kTagMap.min_sightings) {
    const Step variance = squares_ / (count_ - 1.0) / count_;
    position_sigma_m = std::sqrt(kTagMap.min_sigma_m * kTagMap.min_sigma_m + variance.head<3>().sum() / 3);
    angle_sigma_rad = std::sqrt(kTagMap.min_sigma_rad * kTagMap.min_sigma_rad + variance.tail<3>().sum() / 3);
  }
  of_tag.diagonal().head<3>().setConstant(angle_sigma_rad * angle_sigma_rad);
  of_tag.diagonal().tail<3>().setConstant(position_sigma_m * position_sigma_m);
  return camera_covariance(of_tag, T_camera_tag);
}

void TagMapEntry::add_sighting(const Isometry3d& T_world_tag) {
  if (first_) return;
  if (count_ > 0) {
    const Step difference = step_between(mean_, T_world_tag);
    const Step sigma = count_ >= kTagMap.min_sightings ? Step((squares_ / (count_ - 1.0)).cwiseSqrt())
                                                       : Step(Step::Constant(kTagMap.moved_m));
    contradicting_ = contradicts(difference, sigma) ? contradicting_ + 1 : 0;
    if (contradicting_ > 0 && contradicting_ < kTagMap.moved_sightings) return;
  }
  if (count_ == 0 || contradicting_ >= kTagMap.moved_sightings) {
    if (count_ >= kTagMap.min_sightings) T_world_tag_.reset();  // it was moved
    mean_ = T_world_tag;
    squares_.setZero();
    count_ = 1;
    contradicting_ = 0;
    return;
  }
  // Welford's running mean and sum of squares with a limited count.
  if (count_ == kTagMap.max_sightings) {
    squares_ *= (kTagMap.max_sightings - 1.0) / kTagMap.max_sightings;
    --count_;
  }
  ++count_;
  const Step before = step_between(mean_, T_world_tag);
  mean_ = apply_step(mean_, before / count_);
  squares_ += before.cwiseProduct(step_between(mean_, T_world_tag));
  if (count_ >= kTagMap.min_sightings) T_world_tag_ = mean_;
}

std::string TagMapEntry::warning(int id) const {
  if (!T_world_tag_) return capture::formatted("tag %d: not used until it is seen together with others", id);
  if (moved_m_ > 0)
    return capture::formatted("tag %d: it was moved by %.0f mm, objects stay where they were", id, 1e3 * moved_m_);
  if (!configured_ || count_ < kTagMap.min_sightings) return {};
  const Step difference = step_between(*configured_, mean_);
  if (!contradicts(difference, (squares_ / (count_ - 1.0) / count_).cwiseSqrt())) return {};
  return capture::formatted("tag %d: is %.0f mm and %.1f degrees from its configured pose", id,
                            1e3 * difference.head<3>().norm(), difference.tail<3>().norm() * 180 / M_PI);
}

std::optional<MultiTagPose> pose_of_tags(const std::vector<TagReading>& readings,
                                         const std::vector<TagMapEntry>& tag_map) {
  std::vector<std::vector<EvidenceTerm>> evidence_terms(readings.size());
  bool first_seen = false;
  for (std::size_t r = 0; r < readings.size(); ++r) {
    if (!tag_map[readings[r].tag].T_world_tag()) continue;
    first_seen |= readings[r].tag == 0;
    for (const PoseCandidate& candidate : readings[r].candidates)
      evidence_terms[r].push_back(evidence_of(candidate, tag_map[readings[r].tag]));
  }
  // The candidate of a reading that has the least evidence against it from all others.
  MultiTagPose result;
  double best = std::numeric_limits<double>::max();
  std::size_t base = 0;
  for (std::size_t r = 0; r < readings.size(); ++r) {
    if (first_seen && readings[r].tag != 0) continue;
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
    if (r != base && distance(chosen, evidence) > kTagPose.tag_disagreement) {
      result.contradicting.push_back(readings[r].tag);
      continue;
    }
    agreeing.push_back(evidence);
  }
  if (agreeing.size() > 1) average(agreeing, result);
  return result;
}

}  // namespace lumigraft::reconstruct
