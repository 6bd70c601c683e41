#pragma once
// What the scene needs, and no more: a plan that leaves out what carries too little of the light to be seen.
//
// Energy criterion: what a choice leaves out is below kLeftOut of the irradiance, at the probe and where each visible
// object stands. What was set by hand stays (Plan::by_hand), and nothing goes beyond the plan that was asked for.
//
// - max_lights: lamps that are drawn as lamps. The weakest go into the environment while all of them together stay
//   below the bound: their light stays, only the edges of their shadows are lost.
// - sh_bands: bands of the remainder's harmonics; what is dropped is measured as the root of its mean squared
//   irradiance over all normals (Ramamoorthi & Hanrahan 2001, eq. 7 and 8).
// - rsm: where light is traced for pixels, reflective shadow maps of twice the volume's edge: a texel is then below
//   half a voxel, and finer ones inject the same. In cells the lamps' shadows on the room are as fine as they: there
//   it stays.
//
// Methods that draw on no device (Plan::on_device) read none of these: their plan stays as it is.
//
// Calm: more is taken at once, when the bound is passed; less only after it would have kept to half of the bound for
// kCalmFrames frames. The first scene is taken as it is.
#include <array>
#include <memory>
#include <string>
#include <unordered_map>
#include <vector>

#include "reconstruct/scene.h"
#include "relight/exhibit/exhibit.h"
#include "relight/light_measures.h"
#include "relight/objects/placement.h"
#include "relight/plan.h"

namespace lumigraft::relight {

struct PlanChoice {
  std::string key;  ///< of plan.KEY
  int most = 0;     ///< as asked
  int value = 0;    ///< as taken
  /// Share of the irradiance that the value leaves out: above the bound where `most` is too little.
  float left_out = 0;
};

class Planner {
 public:
  static constexpr float kLeftOut = 0.01f;
  static constexpr int kCalmFrames = 60;

  explicit Planner(const Plan& asked) : asked_(asked) {}

  struct Decision {
    Plan plan;
    std::vector<PlanChoice> choices;  ///< none where the scene holds no light, and none of keys that are set by hand
  };
  Decision decide(const reconstruct::Scene& scene, const Exhibit& exhibit, double time_s);

 private:
  /// Of one key: what is left out by 0, 1, 2 ... of it.
  struct Held {
    int value = -1, calm = 0;
    int hold(const std::vector<float>& left_out);
  };
  std::vector<float> shares_left_out(const reconstruct::Illumination& light, const Exhibit& exhibit, double time_s);
  Eigen::Vector3f middle_of(const VirtualObject& object, double time_s);

  Plan asked_;
  Held lights_, bands_;
  std::shared_ptr<const reconstruct::Illumination> measured_;
  LightMeasures measures_;
  std::unordered_map<std::shared_ptr<const Model>, BoundingSphere> spheres_;
};

}  // namespace lumigraft::relight
