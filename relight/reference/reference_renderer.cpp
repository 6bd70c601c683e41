#include "relight/reference/reference_renderer.h"

#include "relight/compose/composer.h"
#include "relight/quality_warnings.h"
#include "relight/reference/delta_path_tracer.h"
#include "relight/tracing/build_trace_scene.h"

namespace lumigraft::relight {
namespace {

/// From the change of whole pixels to that of their part that shows the room.
void divide_by_share_of_room(ReferencePicture& traced) {
  for (std::size_t i = 0; i < traced.change.data.size(); ++i) {
    const float share = 1 - traced.coverage.data[i / 3];
    if (share > 0) traced.change.data[i] /= share;
  }
}

}  // namespace

struct ReferenceRenderer::State {
  capture::Session session;
  Room room;
  std::vector<KnownSurface> known;
  CameraUpload camera;

  // State kept between frames.
  std::shared_ptr<const ReferenceScene> reconstructed;
  reconstruct::Scene of;  ///< from which it was made
  struct Traced {
    std::shared_ptr<const ReferenceScene> room;
    std::vector<ReferenceMesh> objects;
    Eigen::Matrix4f T_tag_camera;
    int samples = 0;
    ReferencePicture picture;  ///< its change is that of the part that shows the room
  };
  std::optional<Traced> last;

  State(const capture::Session& s, Room r)
      : session(s), room(std::move(r)), known(known_surfaces(s.real_surfaces)), camera(s.color) {}

  std::shared_ptr<const ReferenceScene> room_of(const capture::FrameSet& frame, const reconstruct::Scene& scene) {
    if (room) return room(frame);
    if (!reconstructed || of.field != scene.field || of.albedo != scene.albedo || of.enclosure != scene.enclosure ||
        of.illumination != scene.illumination) {
      reconstructed = std::make_shared<const ReferenceScene>(reference_room_of(scene, known));
      of = scene;
    }
    return reconstructed;
  }

  const ReferencePicture& traced(const capture::FrameSet& frame, const reconstruct::Scene& scene,
                                 std::vector<ReferenceMesh> objects, int samples) {
    const std::shared_ptr<const ReferenceScene> now = room_of(frame, scene);
    const Eigen::Isometry3f T_tag_camera = scene.pose->T_tag_camera.cast<float>();
    if (!last || last->room != now || last->T_tag_camera != T_tag_camera.matrix() || last->samples != samples ||
        !same_meshes(last->objects, objects)) {
      auto with_objects = std::make_shared<ReferenceScene>(*now);
      with_objects->objects = objects;
      const DeltaPathTracer tracer(with_objects);
      ReferenceSamples how;
      how.per_pixel = samples;
      last = Traced{now, std::move(objects), T_tag_camera.matrix(), samples,
                    tracer.change({session.color.model, T_tag_camera}, how)};
      divide_by_share_of_room(last->picture);
    }
    return last->picture;
  }
};

ReferenceRenderer::ReferenceRenderer(const capture::Session& session, Room room)
    : state_(std::make_unique<State>(session, std::move(room))) {}
ReferenceRenderer::~ReferenceRenderer() = default;

RelitPicture ReferenceRenderer::relight(const capture::FrameSet& frame, const reconstruct::Scene& scene,
                                        const Exhibit& exhibit, const Plan& plan, bool with_maps) {
  State& s = *state_;
  RelitPicture result;
  result.plan = plan;
  s.camera.take(frame);
  result.srgb = *s.camera.coded();
  std::vector<ReferenceMesh> objects = reference_objects_of(exhibit, static_cast<double>(frame.time_ns) * 1e-9);

  const std::string missing = what_is_missing(scene, !objects.empty(), s.room != nullptr);
  if (!missing.empty()) {
    pass_through(missing, &result);
    return result;
  }
  const ReferencePicture& traced = s.traced(frame, scene, std::move(objects), plan.samples);
  compose(s.camera, {traced.change}, {0, 0, traced.object, traced.coverage, {}}, &result.srgb);
  if (with_maps) {
    RelightMaps maps;
    maps.mask = traced.coverage;
    maps.delta = traced.change;
    result.maps = std::make_shared<const RelightMaps>(std::move(maps));
  }
  return result;
}

}  // namespace lumigraft::relight
