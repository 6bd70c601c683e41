#include "reconstruct/albedo_lamps.h"

#include <algorithm>
#include <cmath>

#include "reconstruct/albedo_refine.h"
#include "reconstruct/albedo_shading.h"

namespace lumigraft {
namespace {

constexpr double kNearest_m = 0.3, kFarthest_m = 8.0;
constexpr int kGridSteps = 16;
constexpr int kFineSteps = 7;
constexpr double kFineReach = 0.22;  ///< of log distance, either way
constexpr int kRounds = 3;           ///< of coordinate descent
constexpr int kShaped = 3;           ///< strongest lamps whose shape is looked into after the grid
constexpr float kQuadrilateral = 0.2f;
/// An outline that speaks against a shape costs this share of the robust sum.
constexpr double kOutlinePenalty = 0.1;

std::vector<double> spaced(double low, double high, int count) {
  std::vector<double> result;
  for (int i = 0; i < count; ++i) result.push_back(low + (high - low) * i / (count - 1));
  return result;
}

double outline_penalty(const PointLight& light, bool flat) {
  return (light.squareness > kQuadrilateral) == flat ? 1 : 1 + kOutlinePenalty;
}

class LampSearch {
 public:
  LampSearch(ShadingModel& model, const std::vector<SamplePair>& pairs, const Eigen::Vector3f& probe)
      : model_(model), pairs_(pairs), shapes_(model.lamps()), factors_(model.lamps()) {
    for (std::size_t lamp = 0; lamp < model.lamps(); ++lamp) {
      model.tabulate(lamp, spaced(std::log(kNearest_m), std::log(kFarthest_m), kGridSteps), 1);
      shapes_[lamp].log_distance = std::log(2.0);
      // A panel faces the probe, the floor, or the tag.
      const Eigen::Vector3f& direction = model.light(lamp).direction;
      std::vector<Eigen::Vector3f> normals{-direction};
      if (direction.z() > 0.3f) normals.push_back(-Eigen::Vector3f::UnitZ());
      const Eigen::Vector3f to_tag = -(probe + 1.2f * direction).normalized();
      if (to_tag.dot(direction) < -0.3f) normals.push_back(to_tag);
      facing_.push_back(normals);
      update(lamp);
    }
  }

  std::vector<LampEstimate> solve() {
    for (int round = 0; round < kRounds; ++round) {
      bool changed = false;
      for (std::size_t lamp = 0; lamp < model_.lamps(); ++lamp) changed |= descend(lamp);
      if (!changed) break;
    }
    refine_shapes();
    for (std::size_t lamp = 0; lamp < model_.lamps(); ++lamp) {
      const double at = shapes_[lamp].log_distance;
      model_.tabulate(lamp, spaced(at - kFineReach, at + kFineReach, kFineSteps), 5);
    }
    const Refinement final = refine_lamps(model_, pairs_, shapes_);
    std::vector<LampEstimate> result;
    for (std::size_t lamp = 0; lamp < model_.lamps(); ++lamp) {
      LampEstimate estimate;
      estimate.distance_m = static_cast<float>(std::exp(final.shapes[lamp].log_distance));
      estimate.log_sigma = static_cast<float>(final.log_sigma[lamp]);
      estimate.flat = final.shapes[lamp].flat;
      if (estimate.flat) estimate.normal = model_.normal(lamp, final.shapes[lamp]);
      result.push_back(estimate);
    }
    return result;
  }

 private:
  void update(std::size_t lamp) { model_.factors(lamp, shapes_[lamp], factors_[lamp]); }

  double penalty(const std::vector<LampShape>& shapes) const {
    double product = 1;
    for (std::size_t lamp = 0; lamp < shapes.size(); ++lamp) {
      product *= outline_penalty(model_.light(lamp), shapes[lamp].flat);
    }
    return product;
  }

  double cost() {
    model_.log_albedo(factors_, log_albedo_);
    return robust_cost(log_albedo_, pairs_) * penalty(shapes_);
  }

  /// The best of all distances and simple shapes of one lamp, the others held.
  bool descend(std::size_t lamp) {
    const LampShape before = shapes_[lamp];
    LampShape best = before;
    double least = cost();
    const auto consider = [&](const LampShape& shape) {
      shapes_[lamp] = shape;
      update(lamp);
      const double here = cost();
      if (here < least) {
        least = here;
        best = shape;
      }
    };
    for (const double log_distance : model_.tabulated(lamp)) {
      consider({log_distance, false, {}});
      for (const Eigen::Vector3f& normal : facing_[lamp]) {
        consider({log_distance, true, model_.tilt_of(lamp, normal)});
      }
    }
    shapes_[lamp] = best;
    update(lamp);
    return best.log_distance != before.log_distance || best.flat != before.flat || best.tilt != before.tilt;
  }

  /// Refines all lamps together, then looks whether one of the strongest would rather be of the other kind.
  void refine_shapes() {
    Refinement best = refine_lamps(model_, pairs_, shapes_);
    double least = best.cost * penalty(best.shapes);
    for (std::size_t lamp = 0; lamp < std::min<std::size_t>(kShaped, model_.lamps()); ++lamp) {
      std::vector<LampShape> other = best.shapes;
      other[lamp].flat = !other[lamp].flat;
      other[lamp].tilt = {};
      const Refinement tried = refine_lamps(model_, pairs_, other);
      if (tried.cost * penalty(tried.shapes) < least) {
        best = tried;
        least = tried.cost * penalty(tried.shapes);
      }
    }
    shapes_ = best.shapes;
  }

  ShadingModel& model_;
  const std::vector<SamplePair>& pairs_;
  std::vector<LampShape> shapes_;
  std::vector<std::vector<Eigen::Vector3f>> facing_;
  std::vector<std::vector<float>> factors_;
  std::vector<Eigen::Array3f> log_albedo_;
};

}  // namespace

std::vector<LampEstimate> locate_lamps(const RoomLight& room, const Illumination& illumination,
                                       const std::vector<SurfaceSample>& samples,
                                       const std::vector<Eigen::Vector3f>& gathered) {
  if (illumination.lights.empty()) return {};
  const std::vector<SamplePair> pairs = choose_pairs(samples);
  ShadingModel model(room, illumination, samples, gathered);
  return LampSearch(model, pairs, illumination.probe_position_m).solve();
}

}  // namespace lumigraft
