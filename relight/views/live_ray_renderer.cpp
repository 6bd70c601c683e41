#include "relight/views/live_ray_renderer.h"

#include <algorithm>
#include <chrono>
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
  LightThread thread;
  ViewDrawer drawer;
  HeldPose held;
  PixelRays pixel_rays;
  std::shared_ptr<const RayRoom> room;

  LightReprojection reprojection;
  MovedObjects::Trees trees;

  // Of the last picture.
  std::shared_ptr<const ViewLight> light;  ///< as it was found
  std::vector<ReferenceMesh> objects;
  Eigen::Isometry3f T_tag_camera = Eigen::Isometry3f::Identity();
  std::shared_ptr<const capture::DepthFrame> last_depth;
  std::unique_ptr<MovedObjects> moved;  ///< `objects`, for `light`
  const ViewLight* shown = nullptr;     ///< `light`, or that reprojected; null: nothing was drawn

  State(const capture::Session& s, std::shared_ptr<const RayModels> models)
      : session(s), thread(s, std::move(models)), drawer(s), held(s.color.model), pixel_rays(s.color.model) {}

  FoundLight find_light(const capture::FrameSet& frame, const reconstruct::Scene& scene, const Exhibit& exhibit,
                        const Plan& plan, const std::vector<ReferenceMesh>& wanted);
};

namespace {

/// Whether these are the objects that light was found for, wherever they are.
bool same_objects(const std::vector<ReferenceMesh>& wanted, const FoundLight& found) {
  return std::ranges::equal(wanted, found.asked, {}, &ReferenceMesh::model);
}

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

/// Whether light was found for objects at these places.
bool in_place(const std::vector<ReferenceMesh>& objects, const ViewLight& light) {
  return std::ranges::equal(objects, light.placed, [](const ReferenceMesh& now, const PlacedModel& then) {
    return now.T_tag_model.matrix() == then.T_tag_model.matrix() && now.pose == then.pose;
  });
}

/// Whether nothing but the camera moved since light was found.
bool holds(const FoundLight& found, const reconstruct::Scene& scene, const std::vector<ReferenceMesh>& objects) {
  const ViewLight& light = *found.light;
  return light.moved < kRelight.few_moved && light.traced_room->illumination() == scene.illumination &&
         in_place(objects, light);
}

}  // namespace

/// Asks for the light of this frame, and waits for it where it must, or where it comes soon.
FoundLight LiveRayRenderer::State::find_light(const capture::FrameSet& frame, const reconstruct::Scene& scene,
                                              const Exhibit& exhibit, const Plan& plan,
                                              const std::vector<ReferenceMesh>& wanted) {
  LightRequest request{frame, scene, exhibit, plan, T_tag_camera, room};
  FoundLight found = thread.newest();
  const bool must_wait = !found.light || !same_objects(wanted, found) || !(plan.budget_ms > 0);
  if (must_wait) {
    thread.wait_idle();
  } else if (holds(found, scene, prepared(wanted, found)) &&
             overlap(found.light->room, found.light->T_tag_camera, T_tag_camera) >= kRelight.min_overlap) {
    const std::chrono::duration<double, std::milli> rested = std::chrono::steady_clock::now() - found.ended;
    if (rested.count() < kRelight.light_rest * found.took_ms) return found;
  }
  const std::optional<std::uint64_t> number = thread.ask(std::move(request));
  if (!number) return found;
  if (must_wait)
    thread.wait(*number);
  else if (found.took_ms <= plan.budget_ms)
    thread.wait_for(*number, plan.budget_ms);
  found = thread.newest();
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
  const std::vector<ReferenceMesh> wanted = reference_objects_of(exhibit, 1e-9 * static_cast<double>(frame.time_ns));
  std::string missing = what_is_missing(scene, !wanted.empty());
  if (missing.empty() && !s.room) missing = "the room is not ready for rays yet";
  if (!missing.empty()) {
    pass_through(missing, &result);
    return result;
  }
  const Eigen::Isometry3d& T_now = scene.pose->T_tag_camera;
  const Eigen::Isometry3f T_tag_camera =
      (s.moved ? s.held.hold(T_now, s.moved->meshes().spheres()) : T_now).cast<float>();
  const bool same_view = s.T_tag_camera.matrix() == T_tag_camera.matrix();
  s.T_tag_camera = T_tag_camera;
  FoundLight found = s.find_light(frame, scene, exhibit, plan, wanted);
  const Exhibit shown = found.preparing.empty() ? exhibit : without(exhibit, found.preparing);
  if (!found.light || !same_objects(wanted, found)) {
    pass_through(being_prepared(found.preparing), &result);
    return result;
  }
  for (const VirtualObject& object : shown.objects) {
    if (!object.visible) continue;
    for (const std::string& line : left_out(object)) result.warnings.push_back("relight: " + line);
  }
  if (!found.preparing.empty()) result.warnings.push_back("relight: " + being_prepared(found.preparing));
  result.plan = found.plan;

  std::vector<ReferenceMesh> objects = prepared(wanted, found);
  const bool new_light = found.light != s.light;
  const bool same_objects = same_meshes(objects, s.objects);
  if (new_light) result.passes.insert(result.passes.end(), found.passes.begin(), found.passes.end());
  if (new_light) s.shown = nullptr;
  s.light = std::move(found.light);
  if (new_light || !same_objects || !s.moved) {
    s.moved = std::make_unique<MovedObjects>(*s.light, objects, s.trees);
    s.objects = std::move(objects);
  }
  const CameraRays eye{s.pixel_rays, {model, T_tag_camera}};
  const CurrentDepth depth(s.pixel_rays, depth_of(frame, model), s.light->traced_room->voxel_m(),
                           s.session.depth_noise());
  const bool anew = new_light || !same_objects || !same_view || frame.depth != s.last_depth || !s.shown;
  s.last_depth = frame.depth;
  if (anew) {
    clock.done("wait for light");
    // Outlines of what moves are those of the frame.
    const bool same_outlines = s.light->front.empty() || found.frame_index == static_cast<std::int64_t>(frame.index);
    const bool found_here =
        s.light->T_tag_camera.matrix() == T_tag_camera.matrix() && in_place(s.objects, *s.light) && same_outlines;
    s.shown = nullptr;  // until it is made: memory may run out
    s.shown = found_here ? s.light.get() : &s.reprojection.reproject(*s.light, *s.moved, eye, depth, clock);
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

}  // namespace lumigraft::relight
