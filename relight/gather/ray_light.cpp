#include "relight/gather/ray_light.h"

#include <algorithm>

#include "relight/gather/gather_quality.h"
#include "relight/objects/mesh_simplify.h"
#include "relight/tracing/world.h"

namespace lumigraft::relight {
namespace {

constexpr int kMostTriangles = 200000;  // of an object
constexpr int kLampPoints = 8;          // of each lamp, at a place of an object
constexpr int kBouncesAnew = 8, kBouncesOn = 2;
constexpr int kMostRounds = 12;      // of gathering anew
constexpr float kSettled = 0.003f;   // share of the change that one more bounce brings
constexpr float kMostShare = 0.95f;  // of a bounce that comes back with the next, where there is a sum to take
constexpr int kCellShare = 4;        // one ray of a cell, of each kind, for so many of an object's place
constexpr std::uint32_t kLampSeed = 1, kObjectSeed = 2, kCellSeed = 3;

bool same_models(const std::vector<ReferenceMesh>& a, const std::vector<ReferenceMesh>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](const ReferenceMesh& x, const ReferenceMesh& y) { return x.model == y.model; });
}

BoundingSphere sphere_around(const RayObjects& objects) {
  std::vector<Eigen::Vector3f> points_m;
  for (const IrradianceProbes::Place& place : objects.places()) points_m.push_back(place.position_m);
  return bounding_sphere(points_m);
}

/// Over all cells and colours, without signs: what they hold after a round, and what it brought.
struct Step {
  float all = 0, brought = 0;
};
Step step_between(const std::vector<Rgb>& before, const std::vector<Rgb>& now) {
  Step step;
  for (std::size_t i = 0; i < now.size(); ++i) {
    step.all += now[i].abs().sum();
    step.brought += (now[i] - before[i]).abs().sum();
  }
  return step;
}

/// What the object needs, taken from what is known or made anew.
PlacedModel placed(const ReferenceMesh& object, const std::vector<PlacedModel>& known) {
  PlacedModel result{object.model, nullptr, nullptr, object.T_tag_model, object.material};
  for (const PlacedModel& other : known) {
    if (other.model != object.model) continue;
    result.places = other.places;
    if (same_material(other.material, object.material)) result.facets = other.facets;
    if (result.facets) return result;
  }
  if (!result.places) {
    result.places =
        std::make_shared<const IrradianceProbes>(place_probes(*simplify_model(*object.model, kMostTriangles)));
  }
  result.facets = std::make_shared<const std::vector<ObjectFacet>>(find_facets(*result.places, object.material));
  return result;
}

}  // namespace

RayLight::World::World(std::shared_ptr<const RayRoom> the_room, std::vector<PlacedModel> placed)
    : room(std::move(the_room)),
      objects(std::move(placed)),
      sphere(sphere_around(objects)),
      cells(room->patches(), sphere, objects),
      places(change_regions(room->lamps(), room->meshes(), objects.meshes())),
      light(*room, objects, cells, sphere) {}

bool RayLight::follow(std::shared_ptr<const RayRoom> room, const std::vector<ReferenceMesh>& objects, const Plan& plan,
                      const std::function<void(const char*)>& done) {
  const int rounds = gather_quality_of(plan.trace_scale).rounds;
  const bool same_plan = rays_ == plan.rays && trace_scale_ == plan.trace_scale;
  const bool same = world_ && world_->room == room && same_meshes(objects_, objects) && same_plan;
  if (same && outstanding_ == 0) return false;
  const bool goes_on = world_ && same_models(objects_, objects) && same_plan;
  if (!same) {
    place(std::move(room), objects, goes_on);
    rays_ = plan.rays;
    trace_scale_ = plan.trace_scale;
    outstanding_ = rounds;
    done("surfaces");
  }
  if (goes_on) {
    turn_ = {rounds, (turn_.now + 1) % rounds};
    --outstanding_;
    gather_on_objects(rounds > 1 ? 1 : kBouncesOn, plan, done);
    gather_in_cells(plan, done);
    return true;
  }
  turn_ = {};
  outstanding_ = 0;
  // Each round is one more bounce between real surfaces. Later ones look alike, each a share of the last: every third
  // time their sum, a geometric series, is taken at once (Aitken 1926).
  float last = 0;
  for (int round = 1; round <= kMostRounds; ++round) {
    std::vector<Rgb>& irradiance = world_->cells.irradiance;
    const std::vector<Rgb> before = irradiance;
    if (round <= plan.bounces) gather_on_objects(kBouncesAnew, plan, done);
    gather_in_cells(plan, done);
    const Step step = step_between(before, irradiance);
    if (round >= plan.bounces && step.brought <= kSettled * step.all) break;
    const float share = last > 0 ? step.brought / last : 1;
    if (round % 3 == 0 && share < kMostShare) {
      for (std::size_t i = 0; i < before.size(); ++i) {
        irradiance[i] += share / (1 - share) * (irradiance[i] - before[i]);
      }
    }
    last = step.brought;
  }
  gather_on_objects(kBouncesAnew, plan, done);  // with all bounces
  return true;
}

void RayLight::place(std::shared_ptr<const RayRoom> room, const std::vector<ReferenceMesh>& objects, bool goes_on) {
  std::vector<PlacedModel> now;
  for (const ReferenceMesh& object : objects) {
    now.push_back(placed(object, placed_));
    placed_.push_back(now.back());
  }
  placed_ = now;
  auto next = std::make_unique<World>(std::move(room), std::move(now));
  // Later bounces change little from frame to frame: they go on from where they were.
  if (goes_on) {
    next->objects.reuse_from(world_->objects);
    next->cells.reuse_from(world_->cells);
  }
  world_ = std::move(next);
  objects_ = objects;
}

void RayLight::gather_on_objects(int bounces, const Plan& plan, const std::function<void(const char*)>& done) {
  World& w = *world_;
  gather_lamps(w.light, kLampPoints, kLampSeed, turn_, w.objects);
  done("object lamps");
  gather_objects(w.light, plan.rays, bounces, kObjectSeed, turn_, w.objects);
  done("objects");
}

void RayLight::gather_in_cells(const Plan& plan, const std::function<void(const char*)>& done) {
  World& w = *world_;
  gather_cells(w.light, w.places, std::max(plan.rays / kCellShare, 1), kCellSeed, turn_, w.cells);
  done("cells");
}

}  // namespace lumigraft::relight
