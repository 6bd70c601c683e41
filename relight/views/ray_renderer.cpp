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
  std::vector<KnownSurface> known;
  ViewLighting lighting;
  ViewDrawer drawer;
  ViewMotion view_motion;
  QualityLadder ladder;
  HeldPose held;
  PixelRays pixel_rays;

  explicit State(const capture::Session& s)
      : session(s),
        known(known_surfaces(s.real_surfaces)),
        lighting(s, known, nullptr, ViewLighting::Views::found),
        drawer(s),
        view_motion(s.color.model),
        held(s.color.model),
        pixel_rays(s.color.model) {}

  void enter_room_of(const reconstruct::Scene& scene, PassClock& clock) {
    const RayRoom* room = lighting.room().get();
    if (room && room->has_surfaces_of(scene) && room->illumination() == scene.illumination) return;
    lighting.enter(std::make_shared<const RayRoom>(scene, known, session.tag));
    clock.done("room");
  }

  MotionBlur motion_blur(const Exhibit& exhibit, const CameraRays& eye, std::int64_t time_ns) const {
    return {motions_while_exposed(session.color, exhibit, time_ns),
            {pixel_rays, eye.camera, lighting.spheres(), [&]() -> const Meshes& { return lighting.meshes(); }}};
  }
};

RayRenderer::RayRenderer(const capture::Session& session) : state_(std::make_unique<State>(session)) {}
RayRenderer::~RayRenderer() = default;

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
  const Exhibit exhibit = s.lighting.prepare(wanted, nullptr);
  const std::vector<ReferenceMesh> objects = reference_objects_of(exhibit, time_s);
  const std::string missing = what_is_missing(scene, !objects.empty());
  if (!missing.empty()) {
    pass_through(missing, &result);
    return result;
  }
  warn_of_objects(exhibit, {}, &result);
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
