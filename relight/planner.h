#pragma once
// Reduces the plan to what the scene needs: leaves out light whose contribution is too small to be visible.
//
// Energy criterion: what a choice leaves out is below max_left_out of the irradiance, at the probe and at each visible
// object. Values set by the user stay (Plan::user_set), and no value exceeds the requested plan.
// - max_lights: lamps rendered as lamps. The weakest are moved into the environment as long as their sum is below the
//   bound: their light is kept, only their shadow edges are lost.
// - sh_bands: bands of the residual environment's spherical harmonics; the dropped part is measured as the root mean
//   square irradiance over all normals (Ramamoorthi & Hanrahan 2001, eq. 7 and 8).
// - rsm: where light is traced per pixel, reflective shadow maps have twice the volume's edge: a texel is then smaller
//   than half a voxel, and finer texels inject the same light. With cells the lamps' shadows on the room have the
//   resolution of these maps, so the value stays.
//
// Methods that do not render on a device (Plan::on_device) read none of these: their plan is unchanged.
//
// Hysteresis: a value is raised at once when the bound is exceeded, and lowered only after the smaller value would have
// kept to half the bound for calm_frames frames. The first scene's values are taken directly.
#include <array>
#include <memory>
#include <string>
#include <unordered_map>
#include <vector>

#include "reconstruct/scene.h"
#include "relight/exhibit/exhibit.h"
#include "relight/objects/placement.h"
#include "relight/plan.h"

namespace lumigraft::relight {

struct PlanChoice {
  std::string key;    ///< of plan.KEY
  int requested = 0;  ///< as requested
  int value = 0;      ///< as chosen
  /// Fraction of the irradiance that the value leaves out; exceeds the bound where `requested` is too small.
  float left_out = 0;
};

/// How much of the light at the probe each part of the illumination contributes.
struct LightMeasures {
  float environment_fraction = 0;  ///< of all light at the probe, ∫L dω: contribution of the residual environment
  /// Truncation error by the last band of the residual environment's spherical harmonics that is kept: root mean square
  /// irradiance of the higher bands over the mean irradiance of all light including lamps, both over all normals.
  std::array<float, 3> bands_left_out{};
};

LightMeasures measure_light(const reconstruct::Illumination& light);

class Planner {
 public:
  explicit Planner(const Plan& asked) : asked_(asked) {}

  struct Decision {
    Plan plan;
    std::vector<PlanChoice> choices;  ///< empty where the scene has no light; without keys set by the user
  };
  Decision decide(const reconstruct::Scene& scene, const Exhibit& exhibit, double time_s);

 private:
  /// For one key: the fraction left out by the values 0, 1, 2 ...
  struct Held {
    int value = -1, calm = 0;
    int hold(const std::vector<float>& left_out);
  };
  std::vector<float> fractions_left_out(const reconstruct::Illumination& light, const Exhibit& exhibit, double time_s);
  Eigen::Vector3f middle_of(const VirtualObject& object, double time_s);

  Plan asked_;
  Held lights_, bands_;
  std::shared_ptr<const reconstruct::Illumination> measured_;
  LightMeasures measures_;
  std::unordered_map<std::shared_ptr<const Model>, BoundingSphere> spheres_;
};

}  // namespace lumigraft::relight
