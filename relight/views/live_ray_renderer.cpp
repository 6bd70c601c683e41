#include "relight/views/live_ray_renderer.h"

#include <algorithm>
#include <chrono>
#include <cstdint>
#include <optional>
#include <utility>

#include "relight/parameters.h"
#include "relight/quality_warnings.h"
#include "relight/tracing/build_trace_scene.h"
#include "relight/views/held_pose.h"
#include "relight/views/light_reprojection.h"
#include "relight/views/light_thread.h"
#include "relight/views/view_drawer.h"

namespace lumigraft::relight {

struct LiveRayRenderer::State {
  capture::Session session;
  std::shared_ptr<const RayModels> models;
  LightThread thread;
  ViewDrawer drawer;
  HeldPose held;
  PixelRays pixel_rays;
  std::shared_ptr<const RayRoom> room;

  LightReprojection reprojection;
  MovedObjects::Trees trees;

  // Of the last picture.
  bool interrupted = false;                ///< it showed no objects: light is that of a moment ago
  std::uint64_t answered = 0;              ///< FoundLight::number
  std::shared_ptr<const ViewLight> light;  ///< as it was found
  std::vector<ReferenceMesh> objects;
  Eigen::Isometry3f T_tag_camera = Eigen::Isometry3f::Identity();
  std::shared_ptr<const capture::DepthFrame> last_depth;
  std::unique_ptr<MovedObjects> moved;  ///< `objects`, for `light`
  const ViewLight* shown = nullptr;     ///< `light`, or that reprojected; null: nothing was drawn

  State(const capture::Session& s, std::shared_ptr<const RayModels> the_models)
      : session(s),
        models(std::move(the_models)),
        thread(s, models),
        drawer(s),
        held(s.color.model),
        pixel_rays(s.color.model) {}

  FoundLight find_light(const capture::FrameSet& frame, const reconstruct::Scene& scene, const Exhibit& exhibit,
                        const Plan& plan, const std::vector<DrawnObject>& asked,
                        const std::vector<ReferenceMesh>& wanted);
  bool may_rest(const FoundLight& found, const reconstruct::Scene& scene,
                const std::vector<ReferenceMesh>& wanted) const;
};

namespace {

/// Those that are prepared.
std::vector<ReferenceMesh> prepared(const std::vector<ReferenceMesh>& wanted, const FoundLight& found) {
  std::vector<ReferenceMesh> objects;
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    if (found.drawn[i]) objects.push_back(wanted[i]);
  }
  return objects;
}

/// The exhibit without what is not prepared.
Exhibit without(Exhibit exhibit, const std::vector<std::string>& preparing) {
  for (VirtualObject& object : exhibit.objects) {
    if (std::ranges::find(preparing, object.name) != preparing.end()) object.visible = false;
  }
  return exhibit;
}

/// Whether light was found for objects at these places, of these materials.
bool in_place(const std::vector<ReferenceMesh>& objects, const ViewLight& light) {
  return std::ranges::equal(objects, light.placed, [](const ReferenceMesh& now, const PlacedModel& then) {
    return now.T_tag_model.matrix() == then.T_tag_model.matrix() && now.pose == then.pose &&
           now.material == then.material && now.white_radiance == then.white_radiance;
  });
}

}  // namespace

/// Whether light of the last view is as good as new light would be, nearly, and may rest.
bool LiveRayRenderer::State::may_rest(const FoundLight& found, const reconstruct::Scene& scene,
                                      const std::vector<ReferenceMesh>& wanted) const {
  const ViewLight& then = *found.light;
  if (found.failure || found.changes || then.moved >= kRelight.few_moved || found.shadows != scene.shadows)
    return false;
  if (!then.traced_room->shares_surfaces_with(*room) || then.traced_room->illumination() != scene.illumination)
    return false;
  if (!in_place(prepared(wanted, found), then)) return false;
  if (overlap(then.room, then.T_tag_camera, T_tag_camera) < kRelight.min_overlap) return false;
  const std::chrono::duration<double, std::milli> rested = std::chrono::steady_clock::now() - found.ended;
  return rested.count() < std::min(kRelight.light_rest * found.took_ms, kRelight.max_light_rest_ms);
}

/// Asks for the light of this frame, and waits for it where it must, or where it comes soon.
FoundLight LiveRayRenderer::State::find_light(const capture::FrameSet& frame, const reconstruct::Scene& scene,
                                              const Exhibit& exhibit, const Plan& plan,
                                              const std::vector<DrawnObject>& asked,
                                              const std::vector<ReferenceMesh>& wanted) {
  FoundLight found = thread.newest();
  const bool must_wait = interrupted || !found.light || found.asked != asked || !(plan.budget_ms > 0) || thread.hangs();
  if (must_wait)
    thread.wait_idle();
  else if (may_rest(found, scene, wanted))
    return found;
  if (const auto number = thread.ask({frame, scene, exhibit, plan, T_tag_camera, room})) {
    if (must_wait)
      thread.wait(*number);
    else if (found.took_ms <= plan.budget_ms)
      thread.wait_for(*number, plan.budget_ms);
    found = thread.newest();
  }
  if (found.failure) std::rethrow_exception(found.failure);
  return found;
}

LiveRayRenderer::LiveRayRenderer(const capture::Session& session, std::shared_ptr<const RayModels> models)
    : state_(std::make_unique<State>(session, std::move(models))) {}
LiveRayRenderer::~LiveRayRenderer() = default;

std::shared_ptr<const RayRoom> LiveRayRenderer::room_of(const reconstruct::Scene& scene) const {
  return state_->thread.room_of(scene);
}
void LiveRayRenderer::take(std::shared_ptr<const RayRoom> room) { state_->room = std::move(room); }

RelitPicture LiveRayRenderer::relight(const capture::FrameSet& frame, const reconstruct::Scene& scene,
                                      const Exhibit& exhibit, const Plan& plan) {
  State& s = *state_;
  const capture::CameraModel& model = s.session.color.model;
  const bool like_camera = plan.look == "camera";
  RelitPicture result;
  result.plan = plan;
  PassClock clock(result.passes);
  s.drawer.take(frame, scene.pose, like_camera, clock);
  result.camera = s.drawer.camera().coded();
  result.srgb = *result.camera;
  const double time_s = 1e-9 * static_cast<double>(frame.time_ns);
  const std::vector<ReferenceMesh> wanted = reference_objects_of(exhibit, time_s);
  std::vector<std::string> preparing;
  for (const VirtualObject& object : exhibit.objects) {
    if (object.drawn(time_s) && !s.models->find(object.model)) preparing.push_back(object.name);
  }
  std::string missing = what_is_missing(scene, preparing.size() < wanted.size(), preparing);
  if (missing.empty() && !s.room) missing = "the room is not ready for rays yet";
  if (!missing.empty()) {
    s.interrupted = true;
    pass_through(missing, &result);
    return result;
  }
  const Eigen::Isometry3d& T_now = scene.pose->T_tag_camera;
  const Eigen::Isometry3f T_tag_camera =
      (s.moved ? s.held.hold(T_now, s.moved->meshes().spheres()) : T_now).cast<float>();
  const bool same_view = s.T_tag_camera.matrix() == T_tag_camera.matrix();
  s.T_tag_camera = T_tag_camera;
  if (!same_view) s.shown = nullptr;
  const std::vector<DrawnObject> asked = drawn_objects(exhibit, time_s);
  FoundLight found = s.find_light(frame, scene, exhibit, plan, asked, wanted);
  const Exhibit shown = found.preparing.empty() ? exhibit : without(exhibit, found.preparing);
  s.interrupted = !found.light;
  if (!found.light || found.asked != asked) {
    pass_through(being_prepared(found.preparing), &result);
    return result;
  }
  warn_of_objects(shown, found.preparing, &result);
  result.plan.trace_scale = found.plan.trace_scale;
  result.plan.rays = found.plan.rays;

  std::vector<ReferenceMesh> objects = prepared(wanted, found);
  const bool new_light = found.light != s.light;
  const bool same_objects = same_meshes(objects, s.objects);
  if (std::exchange(s.answered, found.number) != found.number)
    result.passes.insert(result.passes.end(), found.passes.begin(), found.passes.end());
  if (new_light || !same_objects) {
    s.shown = nullptr;  // until that of now is made: memory may run out
    s.moved.reset();
  }
  s.light = std::move(found.light);
  if (!s.moved) {
    s.moved = std::make_unique<MovedObjects>(*s.light, objects, s.trees);
    s.objects = std::move(objects);
  }
  const CameraRays eye{s.pixel_rays, {model, T_tag_camera}};
  const CurrentDepth depth(s.pixel_rays, depth_of(frame, model), s.light->traced_room->voxel_m(),
                           s.session.depth_noise());
  const bool anew = !s.shown || frame.depth != s.last_depth;
  s.last_depth = frame.depth;
  if (anew) {
    clock.done("wait for light");
    // Outlines of what moves are those of the frame.
    const bool same_outlines = s.light->front.empty() || found.frame_index == static_cast<std::int64_t>(frame.index);
    const bool found_here =
        s.light->T_tag_camera.matrix() == T_tag_camera.matrix() && in_place(s.objects, *s.light) && same_outlines;
    s.shown = nullptr;
    s.shown = found_here ? s.light.get()
                         : &s.reprojection.reproject(*s.light, *s.moved, eye, depth, s.drawer.camera(), clock);
  }
  const ViewLight& light = *s.shown;
  const MotionBlur motion = like_camera ? MotionBlur(motions_while_exposed(s.session.color, shown, frame.time_ns),
                                                     {s.pixel_rays, eye.camera, s.moved->meshes().spheres(),
                                                      [&]() -> const Meshes& { return s.moved->meshes(); }})
                                        : MotionBlur();
  s.drawer.draw(light, anew, eye, depth, motion, clock);
  s.drawer.compose(light, frame, anew, &result.srgb, clock);
  return result;
}

bool LiveRayRenderer::shows_surfaces_of(const reconstruct::Scene& scene) const {
  return state_->light && state_->light->traced_room->has_surfaces_of(scene);
}

}  // namespace lumigraft::relight
