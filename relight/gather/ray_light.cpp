#include "relight/gather/ray_light.h"

#include <algorithm>
#include <utility>

#include "relight/gather/parameters.h"
#include "relight/gather_quality.h"
#include "relight/tracing/photon_tracing.h"
#include "relight/tracing/world.h"

namespace lumigraft::relight {
namespace {

constexpr std::uint32_t kLampSeed = 1, kObjectSeed = 2, kCellSeed = 3, kCausticSeed = 6;

bool same_models(const std::vector<ReferenceMesh>& a, const std::vector<ReferenceMesh>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](const ReferenceMesh& x, const ReferenceMesh& y) { return x.model == y.model; });
}

BoundingSphere sphere_around(const RayObjects& objects) {
  std::vector<Eigen::Vector3f> points_m;
  for (const IrradianceProbes::Place& place : objects.places()) points_m.push_back(place.position_m);
  return bounding_sphere(points_m);
}

}  // namespace

bool BounceSeries::goes_on(std::vector<Rgb>& irradiance, int min_rounds) {
  // Sums of absolute values over all cells and channels: after the round, and of the round's contribution.
  float all = 0, brought = 0;
  for (std::size_t i = 0; i < irradiance.size(); ++i) {
    all += irradiance[i].abs().sum();
    brought += (irradiance[i] - before_[i]).abs().sum();
  }
  if (round_ >= min_rounds && brought <= kGather.settled * all) return false;
  const float ratio = last_ > 0 ? brought / last_ : 1;
  if (round_ % 3 == 0 && ratio < kGather.max_bounce_ratio) {
    for (std::size_t i = 0; i < before_.size(); ++i)
      irradiance[i] += ratio / (1 - ratio) * (irradiance[i] - before_[i]);
  }
  last_ = brought;
  return ++round_ <= kGather.max_bounces;
}

RayLight::World::World(std::shared_ptr<const RayRoom> the_room, std::vector<PlacedModel> placed,
                       const IrradianceChangeCache* known)
    : room(std::move(the_room)),
      objects(std::move(placed)),
      sphere(sphere_around(objects)),
      cells(known ? *known : IrradianceChangeCache(room->patches(), sphere, objects)),
      places(change_regions(room->lamps(), room->meshes(), objects.meshes())),
      light(*room, objects, cells, sphere) {}

Exhibit RayLight::prepare(const Exhibit& exhibit, std::vector<std::string>* preparing) {
  Exhibit ready = exhibit;
  std::erase_if(prepared_, [&](const Prepared& p) {
    return std::ranges::find(exhibit.objects, p.model, &VirtualObject::model) == exhibit.objects.end();
  });
  for (VirtualObject& object : ready.objects) {
    if (!object.model || prepared_of(object.model) || !object.visible) continue;
    object.visible = false;
    preparing->push_back(object.name);
  }
  return ready;
}

RayLight::Prepared* RayLight::prepared_of(const std::shared_ptr<const Model>& model) {
  const auto known = std::ranges::find(prepared_, model, &Prepared::model);
  if (known != prepared_.end()) return &*known;
  std::shared_ptr<const IrradianceProbes> made = models_ ? models_->find(model) : make_ray_model(model);
  return made ? &prepared_.emplace_back(Prepared{model, std::move(made)}) : nullptr;
}

/// Prepares an object from cached data, or creates it. Of another pose only what depends on the pose is computed again.
PlacedModel RayLight::placed(const ReferenceMesh& object) {
  PlacedModel result;
  result.model = object.model;
  Prepared& prepared = *prepared_of(object.model);
  result.at_rest = prepared.places;
  result.pose = object.pose;
  result.T_tag_model = object.T_tag_model;
  result.material = object.material;
  result.white_radiance = object.white_radiance;
  for (const PlacedModel& other : placed_) {
    if (other.at_rest != result.at_rest) continue;
    const bool same_material = other.material == object.material;
    if (same_material) result.facets_at_rest = other.facets_at_rest;
    if (!(other.pose == object.pose)) continue;
    result.places = other.places;
    if (!same_material) continue;
    result.facets = other.facets;
    result.emissive = other.emissive;
    return result;
  }
  if (!result.facets_at_rest) {
    result.facets_at_rest =
        std::make_shared<const std::vector<ObjectFacet>>(find_facets(*result.at_rest, object.material));
  }
  const bool at_rest = object.pose.at_rest();
  if (!result.places)
    result.places = at_rest ? result.at_rest : posed_probes(*result.at_rest, object.pose, prepared.trees);
  result.facets = at_rest ? result.facets_at_rest
                          : std::make_shared<const std::vector<ObjectFacet>>(
                                posed_facets(*result.facets_at_rest, *result.places->model));
  result.emissive = EmissiveSurface::of(*result.places->model, object.material);
  return result;
}

void RayLight::follow(std::shared_ptr<const RayRoom> room, const std::vector<ReferenceMesh>& objects, const Plan& plan,
                      const std::function<void(const char*)>& done) {
  rounds_ = gather_quality_of(plan.trace_scale).rounds;
  const bool same_plan = rays_ == plan.rays && trace_scale_ == plan.trace_scale;
  // What a budget chooses continues from what was found with the choice before.
  const bool similar_plan = same_plan || (plan.budget_ms > 0 && rounds_ > 1);
  same_ = world_ && world_->room == room && same_meshes(objects_, objects) && same_plan;
  if (same_ && outstanding_ == 0 && shadows_ == lit_with_) return;
  const bool all_known = same_models(objects_, objects);
  const bool over_frames = models_ && rounds_ > 1;  // also the first light
  goes_on_ = over_frames || (solved_ && similar_plan && (all_known || rounds_ > 1));
  // What appears or disappears is gathered in twice as many parts, and drawn in the frames between: none does both.
  apart_ = over_frames && (!all_known || bounces_);
  if (apart_) rounds_ *= 2;
  if (same_) return;
  place(std::move(room), objects, goes_on_);
  rays_ = plan.rays;
  trace_scale_ = plan.trace_scale;
  outstanding_ = rounds_;
  // Moving objects continue from nearly correct values; appearing or disappearing ones don't. Restarted also while it
  // moves.
  if (!goes_on_) bounces_.reset();
  if (goes_on_ && (!all_known || bounces_)) bounces_.emplace();
  if (over_frames) world_->objects.begin_with(world_->room->illumination()->environment_sh);
  drawn_first_ = over_frames && !all_known;
  done("surfaces");
  send_photons(plan, done);
}

void RayLight::send_photons(const Plan& plan, const std::function<void(const char*)>& done) {
  const DeltaLight& light = world_->light;
  const PhotonScene scene{world_->room->meshes(),
                          world_->objects.meshes(),
                          world_->room->lamps(),
                          [&light](std::size_t lamp, const auto& p_m, const auto& w, float distance_m) {
                            return light.open_from(lamp, p_m, w, distance_m);
                          },
                          [&light](const MeshHit& hit) { return light.objects().reflects_photons(hit); },
                          [&light](std::uint32_t mesh) { return light.objects().any_reflects_photons(mesh); }};
  if (!has_photons(scene)) return;
  world_->light.set_shadows(shadows_);
  const int count = gather_quality_of(plan.trace_scale).photons;
  world_->light.set_photons(std::make_shared<const PhotonMap>(trace_photons(scene, count, kCausticSeed)));
  done("photons");
}

void RayLight::set_moved(std::shared_ptr<const MovedOccluders> moved, std::shared_ptr<const LightChange> light) {
  moved_ = std::move(moved);
  light_change_ = std::move(light);
  if (world_) world_->light.set_moved(moved_, light_change_);
}

bool RayLight::gather(const Plan& plan, const std::function<void(const char*)>& done) {
  if (shadows_ != lit_with_) outstanding_ = rounds_;
  lit_with_ = shadows_;
  world_->light.set_shadows(shadows_);
  if (same_ && outstanding_ == 0) return std::exchange(draws_next_, false);
  if ((same_ && apart_ && draws_next_) || (!same_ && drawn_first_)) {
    draws_next_ = false;
    return true;
  }
  if (goes_on_) {
    go_on(rounds_, plan, done);
  } else {
    solve(plan, done);
  }
  draws_next_ = same_ && apart_;
  return !draws_next_;
}

void RayLight::solve(const Plan& plan, const std::function<void(const char*)>& done) {
  turn_ = {};
  solved_ = false;  // until all below is done: memory may run out
  BounceSeries bounces;
  std::vector<Rgb>& irradiance = world_->cells.irradiance;
  do {
    bounces.begin(irradiance);
    if (bounces.round() <= plan.bounces) gather_on_objects(kGather.first_bounces, plan, done);
    gather_in_cells(plan, done);
  } while (bounces.goes_on(irradiance, plan.bounces));
  gather_on_objects(kGather.first_bounces, plan, done);  // with all bounces
  outstanding_ = 0;
  solved_ = true;
}

void RayLight::go_on(int rounds, const Plan& plan, const std::function<void(const char*)>& done) {
  std::vector<Rgb>& irradiance = world_->cells.irradiance;
  turn_ = {rounds, (turn_.now + 1) % rounds};
  if (bounces_ && outstanding_ == rounds) bounces_->begin(irradiance);
  const bool any_new = !world_->objects.all_have_light();
  gather_on_objects(any_new ? kGather.first_bounces : rounds > 1 ? 1 : kGather.later_bounces, plan, done);
  gather_in_cells(plan, done);
  if (--outstanding_ > 0 || !bounces_) return;
  if (bounces_->goes_on(irradiance, plan.bounces)) {
    outstanding_ = rounds;
  } else {
    bounces_.reset();
  }
}

void RayLight::place(std::shared_ptr<const RayRoom> room, const std::vector<ReferenceMesh>& objects, bool goes_on) {
  std::vector<PlacedModel> now;
  for (const ReferenceMesh& object : objects) {
    now.push_back(placed(object));
    placed_.push_back(now.back());
  }
  placed_ = now;
  const bool same_cells = world_ && world_->room->shares_surfaces_with(*room) && same_meshes(objects_, objects);
  auto next = std::make_unique<World>(std::move(room), std::move(now), same_cells ? &world_->cells : nullptr);
  // Later bounces change little between frames: they continue from the previous values.
  if (goes_on && world_) {
    next->objects.reuse_from(world_->objects);
    if (!same_cells) next->cells.reuse_from(world_->cells);
  } else if (same_cells) {
    next->cells.irradiance.assign(next->cells.cells().size(), Rgb::Zero());
  }
  world_ = std::move(next);
  world_->light.set_moved(moved_, light_change_);
  objects_ = objects;
}

void RayLight::gather_on_objects(int bounces, const Plan& plan, const std::function<void(const char*)>& done) {
  World& w = *world_;
  gather_lamps(w.light, kGather.lamp_points, kLampSeed, turn_, w.objects);
  done("object lamps");
  gather_objects(w.light, kGather.object_rays * plan.rays, bounces, kObjectSeed, turn_, w.objects);
  done("objects");
}

void RayLight::gather_in_cells(const Plan& plan, const std::function<void(const char*)>& done) {
  World& w = *world_;
  gather_cells(w.light, w.places, std::max(plan.rays / kGather.probe_rays, 1), kCellSeed, turn_, w.cells);
  done("cells");
}

}  // namespace lumigraft::relight
