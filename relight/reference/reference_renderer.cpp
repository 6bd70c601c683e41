#include "relight/reference/reference_renderer.h"

#include <algorithm>
#include <limits>

#include "relight/compose/add_noise.h"
#include "relight/compose/composer.h"
#include "relight/compose/foreground_matte.h"
#include "relight/compose/motion_blur.h"
#include "relight/compose/rgb_image.h"
#include "relight/compose/soften.h"
#include "relight/compose/subsample_chroma.h"
#include "relight/gather/clipped_pixels.h"
#include "relight/gather/moved_surfaces.h"
#include "relight/look/camera_look.h"
#include "relight/quality_warnings.h"
#include "relight/reference/delta_path_tracer.h"
#include "relight/tracing/build_trace_scene.h"

namespace lumigraft::relight {
namespace {

constexpr int kTriangleBlock = 1024;  ///< per thread at a time

/// From the change of whole pixels to that of their part that shows the room.
void divide_by_share_of_room(ReferencePicture& traced) {
  for (std::size_t i = 0; i < traced.change.data.size(); ++i) {
    const float share = 1 - traced.coverage.data[i / 3];
    if (share > 0) traced.change.data[i] /= share;
  }
}

/// Objects where this frame's depth decides what is in front of them, and where the fused room does.
ObjectLayer shown_by(const CurrentDepth& depth, const ReferencePicture& traced) {
  ObjectLayer objects{0, 0, traced.object, traced.coverage, traced.distance_m};
  for (int v = 0; v < traced.distance_m.height; ++v) {
    for (int u = 0; u < traced.distance_m.width; ++u) {
      const std::size_t i = traced.distance_m.index(u, v);
      if (depth.differs(u, v, traced.distance_m.data[i])) {
        set_at(objects.radiance, i, radiance_at(traced.unhidden_object, i));
        objects.coverage.data[i] = traced.unhidden_coverage.data[i];
      }
      if (objects.coverage.data[i] == 0) objects.distance_m.data[i] = 0;
    }
  }
  return objects;
}

/// The model without triangles that are gone: their area becomes zero, as the others keep their numbers.
std::shared_ptr<const Model> without(const GoneSpace& gone, const std::shared_ptr<const Model>& model) {
  std::vector<std::uint8_t> is_gone(model->indices.size() / 3);
  for_each_index(is_gone.size(), kTriangleBlock, [&](std::size_t t) {
    const std::uint32_t* corner = &model->indices[3 * t];
    const Eigen::Vector3f middle_m =
        (model->positions_m[corner[0]] + model->positions_m[corner[1]] + model->positions_m[corner[2]]) / 3;
    is_gone[t] = gone.contains(middle_m);
  });
  if (std::ranges::find(is_gone, 1) == is_gone.end()) return model;
  auto rest = std::make_shared<Model>(*model);
  for (std::size_t t = 0; t < is_gone.size(); ++t) {
    if (is_gone[t]) rest->indices[3 * t + 1] = rest->indices[3 * t + 2] = rest->indices[3 * t];
  }
  return rest;
}

}  // namespace

struct ReferenceRenderer::State {
  capture::Session session;
  Room room;
  std::vector<KnownSurface> known;
  CameraUpload camera;
  CameraLook camera_look;
  PixelRays pixel_rays;

  // State kept between frames.
  std::shared_ptr<const ReferenceScene> reconstructed;
  reconstruct::Scene of;                 ///< from which it was made
  std::unique_ptr<const Meshes> meshes;  ///< its surfaces
  std::vector<LightSampleSet> lamps;     ///< its lamps
  struct Traced {
    std::shared_ptr<const ReferenceScene> room;
    std::vector<ReferenceMesh> objects;
    Eigen::Matrix4f T_tag_camera;
    int samples = 0;
    ReferencePicture picture;              ///< its change is that of the part that shows the room
    std::unique_ptr<const Meshes> meshes;  ///< of the objects; null: not needed yet
  };
  std::optional<Traced> last;
  RecentlyMoved recent;

  State(const capture::Session& s, Room r)
      : session(s),
        room(std::move(r)),
        known(known_surfaces(s.real_surfaces)),
        camera(s.color),
        pixel_rays(s.color.model) {}

  std::shared_ptr<const ReferenceScene> room_of(const capture::FrameSet& frame, const reconstruct::Scene& scene) {
    if (room) return room(frame);
    if (!reconstructed || of.field != scene.field || of.albedo != scene.albedo || of.enclosure != scene.enclosure ||
        of.illumination != scene.illumination) {
      reconstructed = std::make_shared<const ReferenceScene>(reference_room_of(scene, known));
      of = scene;
      meshes = std::make_unique<const Meshes>(reconstructed->real, reconstructed->seen.get());
      lamps.clear();
      for (const ReferenceLamp& lamp : reconstructed->lamps) lamps.emplace_back(lamp, 0);
    }
    return reconstructed;
  }

  /// Surfaces of the reconstructed room at pixels.
  std::vector<GBufferPixel> seen_room(const CameraRays& eye) const {
    const int width = eye.camera.model.width, height = eye.camera.model.height;
    std::vector<GBufferPixel> seen(static_cast<std::size_t>(width) * static_cast<std::size_t>(height));
    for_each_pixel(width, height, kRows, [&](int u, int v) {
      GBufferPixel& p = seen[static_cast<std::size_t>(v * width + u)];
      p.w = eye.ray(u, v);
      if (p.w.isZero(0)) return;
      const auto hit = meshes->hit(eye.camera.T_tag_camera.translation(), p.w, std::numeric_limits<float>::infinity());
      if (!hit) return;
      p.known = true;
      p.depth_m = hit->t_m;
      p.surface = meshes->surface(*hit, p.w);
      p.glossy = p.surface.bsdf.mirrors();
      p.albedo = p.surface.bsdf.diffuse;
    });
    return seen;
  }

  /// The reconstructed room without what is gone of it, and what this frame's depth shows in front of it, with the
  /// albedo that explains its radiance. Pixels of the latter become unknown in `seen`.
  std::shared_ptr<const ReferenceScene> with_moved(const CurrentDepth& depth, const CameraRays& eye,
                                                   std::int64_t time_ns, std::vector<GBufferPixel>& seen,
                                                   const std::vector<ReferenceMesh>& objects) {
    const ArrivedSurface arrived(recent, of.field, session.depth_noise());
    const MovedPixels moved =
        moved_surfaces(*of.illumination, lamps, of.field->voxel_m, eye, depth, camera, seen, &arrived);
    MovedPixels fused;
    for (const auto& [i, pixel] : moved) fused.emplace_back(i, seen[i]);
    recent.add(
        moved, fused,
        [&](const GBufferPixel& p) {
          return ArrivedSurface::is_settled(*of.field, session.depth_noise(), p.surface.position_m, p.depth_m);
        },
        time_ns);
    if (moved.empty()) return reconstructed;
    for (const auto& [i, pixel] : moved) seen[i].known = false;
    auto room_of_now = std::make_shared<ReferenceScene>(*reconstructed);
    // The first mesh is the fused surface.
    room_of_now->real.front().model = without(GoneSpace(eye.camera, depth, arrived), room_of_now->real.front().model);
    ReferenceMesh moved_mesh;
    moved_mesh.model = moved_shell(eye, depth, moved, fused, Meshes(objects, nullptr), true);
    if (moved_mesh.model) room_of_now->real.push_back(std::move(moved_mesh));
    return room_of_now;
  }

  /// After traced(): of its objects.
  MotionBlur motion_blur(const Exhibit& exhibit, const PosedCamera& from, std::int64_t time_ns) {
    std::vector<ObjectMotion> motions = motions_while_exposed(session.color, exhibit, time_ns);
    if (motions.empty()) return {};
    if (!last->meshes) last->meshes = std::make_unique<const Meshes>(last->objects, nullptr);
    return {std::move(motions),
            {pixel_rays, from, last->meshes->spheres(), [this]() -> const Meshes& { return *last->meshes; }}};
  }

  const ReferencePicture& traced(const std::shared_ptr<const ReferenceScene>& now,
                                 const Eigen::Isometry3f& T_tag_camera, std::vector<ReferenceMesh> objects,
                                 int samples) {
    if (!last || last->room != now || last->T_tag_camera != T_tag_camera.matrix() || last->samples != samples ||
        !same_meshes(last->objects, objects)) {
      auto with_objects = std::make_shared<ReferenceScene>(*now);
      with_objects->objects = objects;
      const DeltaPathTracer tracer(with_objects);
      ReferenceSamples how;
      how.per_pixel = samples;
      how.unhidden = !room;
      last = Traced{now,
                    std::move(objects),
                    T_tag_camera.matrix(),
                    samples,
                    tracer.change({session.color.model, T_tag_camera}, how),
                    nullptr};
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
  result.camera = s.camera.coded();
  result.srgb = *result.camera;
  const bool like_camera = plan.look == "camera";
  const capture::CameraModel& camera = s.session.color.model;
  if (like_camera) s.camera_look.follow(s.camera.coded(), camera, scene.pose, depth_of(frame, camera));
  std::vector<ReferenceMesh> objects = reference_objects_of(exhibit, static_cast<double>(frame.time_ns) * 1e-9);

  const std::string missing = what_is_missing(scene, !objects.empty(), {}, s.room != nullptr);
  if (!missing.empty()) {
    pass_through(missing, &result);
    return result;
  }
  const CurrentDepth depth(s.pixel_rays, depth_of(frame, s.session.color.model), s.room ? 0 : scene.field->voxel_m,
                           s.session.depth_noise());
  const CameraRays eye{s.pixel_rays, {s.session.color.model, scene.pose->T_tag_camera.cast<float>()}};
  std::shared_ptr<const ReferenceScene> room = s.room_of(frame, scene);
  std::optional<capture::Image<float>> radiance;  // if any clips
  if (!s.room && (depth.any() || s.camera.any_clipped())) {
    std::vector<GBufferPixel> seen = s.seen_room(eye);
    if (depth.any()) room = s.with_moved(depth, eye, frame.time_ns, seen, objects);
    if (s.camera.any_clipped()) {
      radiance = s.camera.radiance();
      restore_clipped(*scene.illumination, s.lamps, s.camera, seen, *radiance);
    }
  }
  if (!s.room && scene.shadows) {
    auto shadowed = std::make_shared<ReferenceScene>(*room);
    shadowed->shadows = scene.shadows;
    room = std::move(shadowed);
  }
  const ReferencePicture& traced = s.traced(room, eye.camera.T_tag_camera, std::move(objects), plan.samples);
  ObjectLayer shown{0, 0, traced.object, traced.coverage, {}};
  if (!s.room) shown = shown_by(depth, traced);
  if (like_camera) {
    const MotionBlur motion = s.motion_blur(exhibit, eye.camera, frame.time_ns);
    if (motion.any()) shown = motion.of(shown);
    shown = softened(shown, s.camera_look.blur_px(), traced.coverage.width, traced.coverage.height);
  }
  if (!s.room) hide_behind_foreground(depth, s.camera, shown);
  compose(s.camera, {traced.change, radiance ? &*radiance : nullptr}, shown, &result.srgb);
  if (like_camera && frame.color->original)
    subsample_chroma(capture::chroma_block(*frame.color->original), shown, &result.srgb);
  if (like_camera && s.camera_look.noise())
    add_noise(*s.camera_look.noise(), *s.camera.coded(), shown, frame.index, &result.srgb);
  if (with_maps) {
    RelightMaps maps;
    maps.mask = std::move(shown.coverage);
    maps.delta = traced.change;
    result.maps = std::make_shared<const RelightMaps>(std::move(maps));
  }
  return result;
}

}  // namespace lumigraft::relight
