#include "relight/gather/ray_renderer.h"

#include <algorithm>
#include <chrono>
#include <limits>
#include <optional>
#include <string_view>
#include <utility>

#include "relight/compose/add_noise.h"
#include "relight/compose/change_matte.h"
#include "relight/compose/composer.h"
#include "relight/compose/foreground_matte.h"
#include "relight/compose/motion_blur.h"
#include "relight/compose/reduced_view.h"
#include "relight/compose/soften.h"
#include "relight/compose/subsample_chroma.h"
#include "relight/gather/clipped_pixels.h"
#include "relight/gather/gather_grid.h"
#include "relight/gather/influence.h"
#include "relight/gather/light_change.h"
#include "relight/gather/moved_surfaces.h"
#include "relight/gather/object_pixels.h"
#include "relight/gather/parameters.h"
#include "relight/gather/pixel_repair.h"
#include "relight/gather/ray_light.h"
#include "relight/gather/upsample_change.h"
#include "relight/look/camera_look.h"
#include "relight/quality_ladder.h"
#include "relight/quality_warnings.h"
#include "relight/static_view_cache.h"
#include "relight/tracing/build_trace_scene.h"
#include "relight/tracing/parallel_for.h"
#include "relight/view_motion.h"

namespace lumigraft::relight {
namespace {

constexpr std::uint32_t kPixelSeed = 4, kGlossSeed = 5;

class Clock {
 public:
  explicit Clock(std::vector<gpu::PassTime>& passes) : passes_(passes) {}
  void done(const char* pass) {
    const auto now = std::chrono::steady_clock::now();
    passes_.push_back({pass, std::chrono::duration<double, std::milli>(now - last_).count()});
    last_ = now;
  }
  double total_ms() const { return ms_since(began_); }
  double ms_of(std::string_view pass) const {
    double sum = 0;
    for (const gpu::PassTime& one : passes_) sum += one.name == pass ? one.gpu_ms : 0;
    return sum;
  }

 private:
  static double ms_since(std::chrono::steady_clock::time_point moment) {
    return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - moment).count();
  }

  std::vector<gpu::PassTime>& passes_;
  std::chrono::steady_clock::time_point began_ = std::chrono::steady_clock::now(), last_ = began_;
};

}  // namespace

struct RayRenderer::State {
  capture::Session session;
  Rooms rooms;
  std::vector<KnownSurface> known;
  CameraUpload camera;
  RayLight light;

  std::shared_ptr<const RayRoom> room;
  std::vector<LightSampleSet> lamps;

  // State of the last camera view.
  ViewMotion view_motion;
  QualityLadder ladder;
  StaticViewCache still;
  PixelRays pixel_rays;
  /// The view whose pixels the room's below are; none: the camera's own.
  std::optional<ReducedView> reduced;
  Eigen::Matrix4f T_tag_camera = Eigen::Matrix4f::Zero();
  std::shared_ptr<const RayRoom> seen_room;
  GatherQuality detail;
  TileMask tiles;  ///< of `seen` that are traced: of a camera that moves, those that objects or movement may change
  std::vector<GBufferPixel> seen;
  bool clips = false;                     ///< some pixel of the picture they were found in
  std::array<float, 3> gain = {1, 1, 1};  ///< FrameSet::color_gain of that picture
  RecentlyMoved recent;
  MovedPixels covered;  ///< pixels of the room that moved surfaces replace in `seen`
  std::shared_ptr<const capture::DepthFrame> last_depth;
  std::optional<GatherGrid> indirect, gloss;
  bool new_view = false;           ///< nothing was gathered for it yet
  capture::Image<float> change;    ///< 3 channels, L_Δ of real pixels, W/sr/m²
  capture::Image<float> radiance;  ///< 3 channels, of the frame for which `change` is, W/sr/m²
  FullChange full;                 ///< both at the camera's own pixels, if `reduced`
  ObjectPixels objects;
  ObjectLayer shown;  ///< objects as the camera sees them, behind what is in front of them
  CameraLook camera_look;
  float blur_px = 0;     ///< of `shown`,
  bool blurred = false;  ///< and whether the objects' own motion blurs it

  State(const capture::Session& s, Rooms the_rooms, std::shared_ptr<const RayModels> models)
      : session(s),
        rooms(the_rooms),
        known(known_surfaces(s.real_surfaces)),
        camera(s.color),
        light(std::move(models)),
        view_motion(s.color.model),
        still(s.color.model),
        pixel_rays(s.color.model) {}

  const CameraUpload& room_picture() const { return reduced ? reduced->picture() : camera; }
  const capture::CameraModel& room_camera() const { return reduced ? reduced->model() : session.color.model; }
  const capture::Image<float>& full_change() const { return reduced ? full.change : change; }
  const capture::Image<float>& full_radiance() const { return reduced ? full.radiance : radiance; }

  /// Sets how many pixels of the camera, along an edge, a pixel of the room represents; takes the frame at that size.
  void reduce(int scale, const capture::FrameSet& frame) {
    if (scale != (reduced ? reduced->scale() : 1)) {
      reduced.reset();
      if (scale > 1) reduced.emplace(session.color, scale);
      seen_room.reset();
      tiles = {};
      seen.clear();
      covered.clear();
    }
    if (reduced) reduced->take(frame);
  }

  Plan plan_in_budget(const Plan& asked, const Exhibit& exhibit, const reconstruct::Scene& scene,
                      std::int64_t time_ns) {
    return ladder.plan(asked, view_motion.moves(exhibit, scene.pose->T_tag_camera, time_ns),
                       1e-9 * static_cast<double>(time_ns));
  }

  std::shared_ptr<const RayRoom> room_of(const reconstruct::Scene& scene) const {
    return std::make_shared<const RayRoom>(scene, known, session.tag);
  }

  void follow(const reconstruct::Scene& scene, Clock& clock) {
    if (rooms == Rooms::made_here) {
      if (room && room->has_surfaces_of(scene) && room->illumination() == scene.illumination) return;
      enter(room_of(scene));
      clock.done("room");
    } else if (room->illumination() != scene.illumination) {
      enter(std::make_shared<const RayRoom>(*room, scene.illumination));
    }
  }

  void enter(std::shared_ptr<const RayRoom> next) {
    room = std::move(next);
    lamps = light_samples_of(*room);
  }

  /// The last pose, unless the objects have moved in the image since.
  const Eigen::Isometry3d& held(const Eigen::Isometry3d& T) {
    double nearest_m = std::numeric_limits<double>::infinity();
    for (const Eigen::Vector4f& sphere : light.light().objects().meshes().spheres()) {
      const double far_m = (sphere.head<3>().cast<double>() - T.translation()).norm();
      nearest_m = std::min(nearest_m, far_m - static_cast<double>(sphere.w()));
    }
    bool moved = false;
    return still.hold(T, std::max(nearest_m, kGather.min_nearest_m), &moved);
  }

  /// The tiles that the picture needs. `pixels`: one of each tile, unless these are all. `whole`: all are asked for.
  TileMask needed_tiles(const CameraRays& eye, const CurrentDepth& depth, const GatherQuality& asked, bool whole,
                        std::optional<TilePixels>* pixels) const {
    const capture::CameraModel& model = eye.camera.model;
    const Meshes& meshes = light.light().objects().meshes();
    whole = whole || asked.rounds == 1 || !light.is_known();
    // Any part of the room may be seen through them.
    for (std::uint32_t mesh = 0; mesh < meshes.spheres().size(); ++mesh) whole = whole || meshes.transmits(mesh);
    if (whole) return {model.width, model.height, true};
    *pixels = trace_tiles(*room, eye, radiance);
    TileMask needed = influenced_tiles(light.light(), light.cells(), lamps, **pixels, *room_picture().coded(), asked);
    add_object_tiles(meshes.spheres(), eye, needed);
    add_moved_tiles(eye, depth, *room->field(), {recent, room->field(), session.depth_noise()}, needed);
    return needed;
  }

  /// Updates the G-buffer: of the room, unless the view is unchanged, and of what moved in it since it was fused. Of a
  /// camera that moves, only tiles that the objects or movement may change; if one at rest needs others, it gets all.
  void look(const capture::FrameSet& frame, const CameraRays& eye, const CurrentDepth& depth,
            const GatherQuality& asked, bool whole, Clock& clock) {
    const Eigen::Matrix4f& T = eye.camera.T_tag_camera.matrix();
    const CameraUpload& picture = room_picture();
    // What clips is restored in the light of now.
    const bool other_light =
        seen_room && seen_room->illumination() != room->illumination() && (clips || picture.any_clipped());
    // With another exposure other pixels clip.
    const bool other_exposure = clips && gain != frame.color_gain;
    const bool at_rest = T_tag_camera == T, all_traced = tiles.has_all();
    bool same_surfaces =
        at_rest && seen_room && seen_room->shares_surfaces_with(*room) && !other_light && !other_exposure;
    bool same_view = same_surfaces && detail == asked;
    if (same_view && frame.depth == last_depth && (all_traced || !(whole || light.changes()))) return;
    seen_room.reset();  // until all below is done: memory may run out
    if (!same_surfaces) radiance = picture.radiance();
    std::optional<TilePixels> pixels;
    if (!same_surfaces || !all_traced) {
      TileMask needed = needed_tiles(eye, depth, asked, whole || (at_rest && all_traced), &pixels);
      if (same_surfaces && !tiles.has_all_of(needed)) {
        needed = {eye.camera.model.width, eye.camera.model.height, true};
        pixels.reset();
        radiance = picture.radiance();
        same_surfaces = same_view = false;
      }
      if (!same_surfaces) tiles = std::move(needed);
      clock.done("tiles");
      if (same_view && frame.depth == last_depth) {
        seen_room = room;
        return;
      }
    }
    const bool had_moved = !covered.empty();
    for (const auto& [i, pixel] : std::exchange(covered, {})) seen[i] = pixel;
    if (!same_surfaces) trace_room(*room, eye, radiance, tiles, seen);
    auto light_change =
        std::make_shared<LightChange>(eye.camera, depth, picture, room->voxel_m(), seen, pixels ? &*pixels : nullptr);
    if (!same_surfaces) {
      light_change->exclude_from(seen, radiance);
      fill_holes(eye.camera, radiance, picture.exposure(), tiles, seen);
      sharpen_edges(eye.camera, radiance, picture.exposure(), room->voxel_m(), tiles, seen);
      clips = restore_clipped(*room->illumination(), lamps, picture, seen, radiance);
      T_tag_camera = T;
      gain = frame.color_gain;
    }
    MovedPixels moved;
    const ArrivedSurface arrived(recent, room->field(), session.depth_noise());
    if (depth.any()) {
      moved = moved_surfaces(*room->illumination(), lamps, room->voxel_m(), eye, depth, picture, seen, &arrived);
      // Where depth sees through fused surface to other fused surface, that is what the pixel shows: a point of noisy
      // depth would be behind it for half of the pixels, and in its shadow.
      for_each_index(moved.size(), kRows * eye.camera.model.width, [&](std::size_t k) {
        auto& [i, pixel] = moved[k];
        const auto u = static_cast<int>(i) % eye.camera.model.width, v = static_cast<int>(i) / eye.camera.model.width;
        if (!seen[i].known || !(seen[i].depth_m < pixel.depth_m) || !depth.differs(u, v, seen[i].depth_m)) return;
        if (auto behind = room_behind(*room, eye, depth, u, v, seen[i].depth_m, picture.radiance(i)))
          pixel = std::move(*behind);
      });
      for (const auto& [i, pixel] : moved) {
        covered.emplace_back(i, std::exchange(seen[i], pixel));
        set_at(radiance, i, picture.radiance(i));
      }
    }
    std::shared_ptr<const MovedOccluders> occluders;
    if (!moved.empty()) {
      occluders =
          std::make_shared<const MovedOccluders>(eye, depth, moved, covered, light.light().objects().meshes(), arrived);
      light_change->predict(*room, lamps, *occluders, covered);
    }
    light.set_moved(std::move(occluders), light_change->any() ? std::move(light_change) : nullptr);
    const auto settled = [&](const GBufferPixel& p) {
      return ArrivedSurface::is_settled(*room->field(), session.depth_noise(), p.surface.position_m, p.depth_m);
    };
    recent.add(moved, covered, settled, frame.time_ns);
    last_depth = frame.depth;
    if (!same_view || had_moved || !moved.empty()) {
      detail = asked;
      gloss.reset();
      const capture::CameraModel& model = eye.camera.model;
      change = capture::Image<float>(model.width, model.height, 3);
      indirect.emplace(seen, model, detail.gather, GatherGrid::Of::even);
      if (!known.empty()) gloss.emplace(seen, model, detail.gather, GatherGrid::Of::glossy);
      new_view = true;
      clock.done("pixels");
    }
    seen_room = room;
  }

  RoomPixels room_pixels() const { return {seen, room_camera(), reduced ? reduced->scale() : 1}; }

  /// One of 255 equal steps to the white of the picture, W/sr/m².
  float grey_level() const { return 1 / (255 * camera.exposure().maxCoeff()); }

  /// `eye`, `depth`: of the camera's own pixels.
  void see(const CameraRays& eye, const CurrentDepth& depth, int rays, Clock& clock) {
    const UpdateSubset turn = new_view ? UpdateSubset{} : light.turn();
    new_view = true;  // until finish() is done: if anything throws, everything is recomputed
    const std::vector<EmitterSampleSet>& emitters = light.light().objects().emitter_samples();
    find_change(emitters, rays, turn, clock);
    if (gloss) {
      gloss->gather(light.light(), light.places(), rays, grey_level(), kGlossSeed, turn);
      const std::vector<Eigen::Array4f> found = gloss->at_pixels();
      for (std::size_t i = 0; i < seen.size(); ++i) {
        if (seen[i].glossy) set_at(change, i, found[i].head<3>());
      }
      clock.done("gloss");
    }
    const SeenRadiance picture(seen, radiance, {room_camera(), eye.camera.T_tag_camera},
                               kGather.seen_voxels * room->voxel_m());
    objects = trace_objects(light.light(), light_sources(lamps, emitters), room_pixels(), eye, depth, picture, detail,
                            grey_level(), std::move(objects));
    clock.done("object pixels");
  }

  /// The change of light at the outlines of what moved in front of the room.
  void divide_at_outlines(const CurrentDepth& depth) {
    const capture::CameraModel& model = session.color.model;
    const capture::Image<std::uint8_t> front = front_mask(covered, room_pixels(), depth, model.width, model.height);
    divide_change(depth, camera, front, objects, reduced ? full.change : change);
  }

  /// From `objects` to `shown`, and with a new `change` that at outlines. Neither needs the other.
  void finish(const CameraRays& eye, const CurrentDepth& depth, const MotionBlur& motion, bool changed, Clock& clock) {
    if (changed && reduced) {
      upsample({room_pixels(), change, radiance, tiles}, eye, depth, objects, camera, full);
      clock.done("upsample");
    }
    const bool divided = changed && !covered.empty();
    for_each_index(divided ? 2 : 1, 1,
                   [&](int k) { k == 0 ? show_objects(depth, motion) : divide_at_outlines(depth); });
    if (changed) new_view = false;
    clock.done("soften and mattes");
  }
  MotionBlur motion_blur(const Exhibit& exhibit, std::int64_t time_ns) const {
    const Meshes& meshes = light.light().objects().meshes();
    return {
        motions_while_exposed(session.color, exhibit, time_ns),
        {pixel_rays, {session.color.model, Eigen::Isometry3f(T_tag_camera)}, meshes.spheres(), [&]() -> const Meshes& {
           return meshes;
         }}};
  }
  void show_objects(const CurrentDepth& depth, const MotionBlur& motion) {
    const int width = session.color.model.width, height = session.color.model.height;
    shown =
        motion.any() ? softened(motion.of(objects), blur_px, width, height) : softened(objects, blur_px, width, height);
    hide_behind_foreground(depth, camera, shown);
  }

  void find_change(const std::vector<EmitterSampleSet>& emitters, int rays, const UpdateSubset& turn, Clock& clock) {
    const std::vector<Eigen::Array4f> hidden = hidden_by_objects(light.light(), lamps, seen, room_camera(), detail);
    const std::vector<Eigen::Array4f> added = lit_by_objects(light.light(), emitters, seen, room_camera(), detail);
    clock.done("shadows");
    indirect->gather(light.light(), light.places(), rays, grey_level(), kPixelSeed, turn);
    std::vector<Eigen::Array4f> delta = indirect->at_pixels();
    const LightChange* light_change = light.light().light_change();
    for_each_index(delta.size(), kRows * change.width, [&](std::size_t i) {
      delta[i] += added[i];
      const GBufferPixel& pixel = seen[i];
      if (pixel.known && !pixel.glossy)
        delta[i].head<3>() += light.light().caustic(pixel.surface.position_m, pixel.surface.face);
      delta[i] -=
          light_change && hidden[i].maxCoeff() > 0 ? hidden[i].min(light_change->lamps_now(lamps, seen[i])) : hidden[i];
    });
    for_each_pixel(tiles, change.width, change.height, kRows, [&](int u, int v) {
      const auto i = static_cast<std::size_t>(v * change.width + u);
      const bool even = seen[i].known && !seen[i].glossy;
      set_at(change, i, even ? Rgb(seen[i].albedo / kPi * delta[i].head<3>()) : Rgb::Zero());
    });
    clock.done("gather");
  }

  std::shared_ptr<const RelightMaps> maps() const {
    const capture::CameraModel& model = session.color.model;
    auto maps = std::make_shared<RelightMaps>();
    maps->mask = maps->depth_m = capture::Image<float>(model.width, model.height, 1);
    maps->delta = full_change();
    maps->albedo = maps->normals = capture::Image<float>(model.width, model.height, 3);
    const Eigen::Vector3f eye_m = T_tag_camera.topRightCorner<3, 1>(), forward = T_tag_camera.block<3, 1>(0, 2);
    const auto tell = [&](std::size_t i, const GBufferPixel& p) {
      set_at(maps->albedo, i, p.albedo);
      set_at(maps->normals, i, p.surface.normal.array());
      maps->depth_m.data[i] = forward.dot(p.surface.position_m - eye_m);
    };
    const RoomPixels pixels = room_pixels();
    for (int v = 0; v < model.height; ++v) {
      for (int u = 0; u < model.width; ++u) {
        if (const GBufferPixel& p = pixels.at(u, v); p.known) tell(maps->mask.index(u, v), p);
      }
    }
    // Where an object covers a pixel, the maps describe the object.
    for (int v = 0; v < shown.coverage.height; ++v) {
      for (int u = 0; u < shown.coverage.width; ++u) {
        const std::size_t i = maps->mask.index(u + shown.left, v + shown.top);
        maps->mask.data[i] = shown.coverage.at(u, v);
        const int x = u + shown.left - objects.left, y = v + shown.top - objects.top;
        if (maps->mask.data[i] < 0.5f || x < 0 || y < 0 || x >= objects.coverage.width || y >= objects.coverage.height)
          continue;
        const GBufferPixel& surface = objects.surfaces[objects.coverage.index(x, y)];
        if (surface.known) tell(i, surface);
      }
    }
    return maps;
  }
};

RayRenderer::RayRenderer(const capture::Session& session, Rooms rooms, std::shared_ptr<const RayModels> models)
    : state_(std::make_unique<State>(session, rooms, std::move(models))) {}
RayRenderer::~RayRenderer() = default;

std::shared_ptr<const RayRoom> RayRenderer::room_of(const reconstruct::Scene& scene) const {
  return state_->room_of(scene);
}
void RayRenderer::take(std::shared_ptr<const RayRoom> room) { state_->enter(std::move(room)); }

RelitPicture RayRenderer::relight(const capture::FrameSet& frame, const reconstruct::Scene& scene,
                                  const Exhibit& wanted, const Plan& asked, bool with_maps) {
  State& s = *state_;
  RelitPicture result;
  result.plan = asked;
  s.camera.take(frame);
  result.camera = s.camera.coded();
  result.srgb = *result.camera;
  const bool like_camera = asked.look == "camera";
  Clock clock(result.passes);
  if (like_camera) {
    const capture::CameraModel& camera = s.session.color.model;
    s.camera_look.follow(s.camera.coded(), camera, scene.pose, depth_of(frame, camera));
    clock.done("camera look");
  }
  std::vector<std::string> preparing;
  const Exhibit exhibit = s.light.prepare(wanted, &preparing);
  const std::vector<ReferenceMesh> objects = reference_objects_of(exhibit, static_cast<double>(frame.time_ns) * 1e-9);
  std::string missing = what_is_missing(scene, !objects.empty(), preparing);
  if (missing.empty() && s.rooms == Rooms::taken && !s.room) missing = "the room is not ready for rays yet";
  if (!missing.empty()) {
    pass_through(missing, &result);
    return result;
  }
  for (const VirtualObject& object : exhibit.objects) {
    if (!object.visible) continue;
    for (const std::string& line : left_out(object)) result.warnings.push_back("relight: " + line);
  }
  if (!preparing.empty()) result.warnings.push_back("relight: " + being_prepared(preparing));
  s.follow(scene, clock);
  const bool chooses = QualityLadder::chooses(asked);
  const Plan& plan = result.plan = chooses ? s.plan_in_budget(asked, exhibit, scene, frame.time_ns) : asked;
  const auto done = [&](const char* pass) { clock.done(pass); };
  s.light.set_shadows(scene.shadows);
  s.light.follow(s.room, objects, plan, done);
  const CameraRays eye{s.pixel_rays, {s.session.color.model, s.held(scene.pose->T_tag_camera).cast<float>()}};
  const CurrentDepth depth(s.pixel_rays, depth_of(frame, s.session.color.model), s.room->voxel_m(),
                           s.session.depth_noise());
  const GatherQuality quality = gather_quality_of(plan.trace_scale);
  s.reduce(quality.room, frame);
  if (s.reduced) {
    const ReducedView& view = *s.reduced;
    s.look(frame, {view.rays(), {view.model(), eye.camera.T_tag_camera}},
           {view.rays(), view.depth_m(), depth.voxel_m(), s.session.depth_noise()}, quality, with_maps, clock);
  } else {
    s.look(frame, eye, depth, quality, with_maps, clock);
  }
  const bool lit_anew = s.light.gather(plan, done), seen_anew = lit_anew || s.new_view;
  if (seen_anew) s.see(eye, depth, plan.rays, clock);
  const float blur_px = like_camera ? s.camera_look.blur_px() : 0;
  const MotionBlur motion = like_camera ? s.motion_blur(exhibit, frame.time_ns) : MotionBlur();
  if (seen_anew || s.blur_px != blur_px || s.blurred != motion.any()) {
    s.blur_px = blur_px;
    s.blurred = motion.any();
    s.finish(eye, depth, motion, seen_anew, clock);
  }
  compose(s.camera, {s.full_change(), &s.full_radiance(), like_camera}, s.shown, &result.srgb);
  if (like_camera && frame.color->original)
    subsample_chroma(capture::chroma_block(*frame.color->original), s.shown, &result.srgb);
  if (seen_anew) clock.done("compose");
  if (like_camera && s.camera_look.noise()) {
    add_noise(*s.camera_look.noise(), *s.camera.coded(), s.shown, frame.index, &result.srgb);
    clock.done("noise");
  }
  if (chooses) s.ladder.took(clock.total_ms() - clock.ms_of("room"), seen_anew);
  if (with_maps) result.maps = s.maps();
  return result;
}

}  // namespace lumigraft::relight
