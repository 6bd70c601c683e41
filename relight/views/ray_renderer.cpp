#include "relight/views/ray_renderer.h"

#include <utility>

#include "relight/quality_ladder.h"
#include "relight/quality_warnings.h"
#include "relight/tracing/build_trace_scene.h"
#include "relight/view_motion.h"
#include "relight/views/held_pose.h"
#include "relight/views/view_drawer.h"
#include "relight/views/view_lighting.h"

namespace lumigraft::relight {

struct RayRenderer::State {
  capture::Session session;
  Rooms rooms;
  ViewLighting lighting;
  ViewDrawer drawer;
  ViewMotion view_motion;
  QualityLadder ladder;
  HeldPose held;
  PixelRays pixel_rays;

  State(const capture::Session& s, Rooms the_rooms, std::shared_ptr<const RayModels> models)
      : session(s),
        rooms(the_rooms),
        lighting(s, std::move(models), ViewLighting::Views::found),
        drawer(s),
        view_motion(s.color.model),
        held(s.color.model),
        pixel_rays(s.color.model) {}

  void enter_room_of(const reconstruct::Scene& scene, PassClock& clock) {
    const RayRoom* room = lighting.room().get();
    if (rooms == Rooms::made_here) {
      if (room && room->has_surfaces_of(scene) && room->illumination() == scene.illumination) return;
      lighting.enter(lighting.room_of(scene));
      clock.done("room");
    } else if (room->illumination() != scene.illumination) {
      lighting.enter(std::make_shared<const RayRoom>(*room, scene.illumination));
    }
  }

  MotionBlur motion_blur(const Exhibit& exhibit, const CameraRays& eye, std::int64_t time_ns) const {
    return {motions_while_exposed(session.color, exhibit, time_ns),
            {pixel_rays, eye.camera, lighting.spheres(), [&]() -> const Meshes& { return lighting.meshes(); }}};
  }
};

RayRenderer::RayRenderer(const capture::Session& session, Rooms rooms, std::shared_ptr<const RayModels> models)
    : state_(std::make_unique<State>(session, rooms, std::move(models))) {}
RayRenderer::~RayRenderer() = default;

std::shared_ptr<const RayRoom> RayRenderer::room_of(const reconstruct::Scene& scene) const {
  return state_->lighting.room_of(scene);
}
void RayRenderer::take(std::shared_ptr<const RayRoom> room) { state_->lighting.enter(std::move(room)); }

RelitPicture RayRenderer::relight(const capture::FrameSet& frame, const reconstruct::Scene& scene,
                                  const Exhibit& wanted, const Plan& asked, bool with_maps) {
  State& s = *state_;
  const capture::CameraModel& model = s.session.color.model;
  const double time_s = 1e-9 * static_cast<double>(frame.time_ns);
  const bool like_camera = asked.look == "camera";
  RelitPicture result;
  result.plan = asked;
  PassClock clock(result.passes);
  s.drawer.take(frame, scene.pose, like_camera, clock);
  result.camera = s.drawer.camera().coded();
  result.srgb = *result.camera;
  std::vector<std::string> preparing;
  const Exhibit exhibit = s.lighting.prepare(wanted, &preparing);
  const std::vector<ReferenceMesh> objects = reference_objects_of(exhibit, time_s);
  std::string missing = what_is_missing(scene, !objects.empty(), preparing);
  if (missing.empty() && s.rooms == Rooms::taken && !s.lighting.room()) missing = "the room is not ready for rays yet";
  if (!missing.empty()) {
    pass_through(missing, &result);
    return result;
  }
  for (const VirtualObject& object : exhibit.objects) {
    if (!object.visible) continue;
    for (const std::string& line : left_out(object)) result.warnings.push_back("relight: " + line);
  }
  if (!preparing.empty()) result.warnings.push_back("relight: " + being_prepared(preparing));
  s.enter_room_of(scene, clock);
  const bool chooses = QualityLadder::chooses(asked);
  if (chooses) {
    const bool moves = s.view_motion.moves(exhibit, scene.pose->T_tag_camera, frame.time_ns);
    result.plan = s.ladder.plan(asked, moves, time_s);
  }
  s.lighting.follow(scene, objects, result.plan, clock);
  const Eigen::Isometry3f T_tag_camera = s.held.hold(scene.pose->T_tag_camera, s.lighting.spheres()).cast<float>();
  const CameraRays eye{s.pixel_rays, {model, T_tag_camera}};
  const CurrentDepth depth(s.pixel_rays, depth_of(frame, model), s.lighting.room()->voxel_m(), s.session.depth_noise());
  const bool anew = s.lighting.find(frame, s.drawer.camera(), T_tag_camera, result.plan, with_maps, clock);
  const ViewLight& light = s.lighting.found();
  const MotionBlur motion = like_camera ? s.motion_blur(exhibit, eye, frame.time_ns) : MotionBlur();
  s.drawer.draw(light, anew, eye, depth, motion, clock);
  s.drawer.compose(light, frame, anew, &result.srgb, clock);
  if (chooses) s.ladder.took(clock.total_ms() - clock.ms_of("room"), anew);
  if (with_maps) result.maps = s.lighting.maps(s.drawer.change(light), s.drawer.shown());
  return result;
}

}  // namespace lumigraft::relight
