#include "relight/views/view_lighting.h"

#include <algorithm>
#include <utility>

#include "relight/gather/clipped_pixels.h"
#include "relight/gather/influence.h"
#include "relight/gather/light_change.h"
#include "relight/gather/moved_surfaces.h"
#include "relight/gather/parameters.h"
#include "relight/gather/pixel_repair.h"
#include "relight/tracing/build_trace_scene.h"
#include "relight/tracing/parallel_for.h"

namespace lumigraft::relight {
namespace {

constexpr std::uint32_t kPixelSeed = 4, kGlossSeed = 5;

/// `normal`: which of a surface's.
std::vector<ViewSurface> described(const std::vector<GBufferPixel>& pixels, Eigen::Vector3f SurfaceHit::*normal,
                                   std::vector<ViewSurface> memory) {
  memory.resize(pixels.size());
  for_each_index(pixels.size(), kGather.patch_block, [&](std::size_t i) {
    const GBufferPixel& p = pixels[i];
    memory[i] = {p.surface.position_m, p.surface.*normal, p.depth_m, p.known, p.glossy};
  });
  return memory;
}

}  // namespace

ViewLighting::ViewLighting(const capture::Session& session, const std::vector<KnownSurface>& known,
                           std::shared_ptr<const RayModels> models, Views views)
    : session_(session),
      views_(views),
      any_known_(!known.empty()),
      light_(std::move(models)),
      pixel_rays_(session.color.model) {}

void ViewLighting::enter(std::shared_ptr<const RayRoom> room) {
  room_ = std::move(room);
  lamps_ = light_samples_of(*room_);
}

void ViewLighting::follow(const reconstruct::Scene& scene, const std::vector<ReferenceMesh>& objects, const Plan& plan,
                          PassClock& clock) {
  light_.set_shadows(scene.shadows);
  light_.follow(room_, objects, plan, [&](const char* pass) { clock.done(pass); });
}

bool ViewLighting::find(const capture::FrameSet& frame, const CameraUpload& camera,
                        const Eigen::Isometry3f& T_tag_camera, const Plan& plan, bool whole, PassClock& clock) {
  camera_ = &camera;
  const CameraRays eye{pixel_rays_, {session_.color.model, T_tag_camera}};
  const CurrentDepth depth(pixel_rays_, depth_of(frame, session_.color.model), room_->voxel_m(),
                           session_.depth_noise());
  const GatherQuality quality = gather_quality_of(plan.trace_scale);
  reduce(quality.room, frame);
  if (reduced_) {
    const ReducedView& view = *reduced_;
    look(frame, {view.rays(), {view.model(), eye.camera.T_tag_camera}},
         {view.rays(), view.depth_m(), depth.voxel_m(), session_.depth_noise()}, quality, whole, clock);
  } else {
    look(frame, eye, depth, quality, whole, clock);
  }
  const bool lit_anew = light_.gather(plan, [&](const char* pass) { clock.done(pass); });
  if (!lit_anew && !new_view_) return false;
  see(eye, depth, plan.rays, clock);
  describe(eye, depth);
  new_view_ = false;
  return true;
}

/// Sets how many pixels of the camera, along an edge, a pixel of the room represents; takes the frame at that size.
void ViewLighting::reduce(int scale, const capture::FrameSet& frame) {
  if (scale != (reduced_ ? reduced_->scale() : 1)) {
    reduced_.reset();
    if (scale > 1) reduced_.emplace(session_.color, scale);
    seen_room_.reset();
    found_.room.tiles = {};
    seen_.clear();
    covered_.clear();
  }
  if (reduced_) reduced_->take(frame);
}

/// The tiles that the picture needs. `pixels`: one of each tile, unless these are all. `whole`: all are asked for.
TileMask ViewLighting::needed_tiles(const CameraRays& eye, const CurrentDepth& depth, const GatherQuality& asked,
                                    bool whole, std::optional<TilePixels>* pixels) const {
  const capture::CameraModel& model = eye.camera.model;
  const Meshes& meshes = light_.light().objects().meshes();
  whole = whole || asked.rounds == 1 || !light_.is_known();
  // Any part of the room may be seen through them.
  for (std::uint32_t mesh = 0; mesh < meshes.spheres().size(); ++mesh) whole = whole || meshes.transmits(mesh);
  if (whole) return {model.width, model.height, true};
  *pixels = trace_tiles(*room_, eye, radiance());
  TileMask needed = influenced_tiles(light_.light(), light_.cells(), lamps_, **pixels, *room_picture().coded(), asked);
  add_object_tiles(meshes.spheres(), eye, needed);
  add_moved_tiles(eye, depth, *room_->field(), {recent_, room_->field(), session_.depth_noise()}, needed);
  return needed;
}

/// Updates the G-buffer: of the room, unless the view is unchanged, and of what moved in it since it was fused. Of a
/// camera that moves, only tiles that the objects or movement may change; if one at rest needs others, it gets all.
void ViewLighting::look(const capture::FrameSet& frame, const CameraRays& eye, const CurrentDepth& depth,
                        const GatherQuality& asked, bool whole, PassClock& clock) {
  const Eigen::Matrix4f& T = eye.camera.T_tag_camera.matrix();
  const CameraUpload& picture = room_picture();
  // What clips is restored in the light of now.
  const bool other_light =
      seen_room_ && seen_room_->illumination() != room_->illumination() && (clips_ || picture.any_clipped());
  // With another exposure other pixels clip.
  const bool other_exposure = clips_ && gain_ != frame.color_gain;
  const bool at_rest = T_tag_camera_ == T, all_traced = tiles().has_all();
  bool same_surfaces =
      at_rest && seen_room_ && seen_room_->shares_surfaces_with(*room_) && !other_light && !other_exposure;
  bool same_view = same_surfaces && detail_ == asked;
  if (same_view && frame.depth == last_depth_ && (all_traced || !(whole || light_.changes()))) return;
  seen_room_.reset();  // until all below is done: memory may run out
  if (!same_surfaces) radiance() = picture.radiance();
  std::optional<TilePixels> pixels;
  if (!same_surfaces || !all_traced) {
    TileMask needed = needed_tiles(eye, depth, asked, whole || (at_rest && all_traced), &pixels);
    if (same_surfaces && !tiles().has_all_of(needed)) {
      needed = {eye.camera.model.width, eye.camera.model.height, true};
      pixels.reset();
      radiance() = picture.radiance();
      same_surfaces = same_view = false;
    }
    if (!same_surfaces) tiles() = std::move(needed);
    clock.done("tiles");
    if (same_view && frame.depth == last_depth_) {
      seen_room_ = room_;
      return;
    }
  }
  const bool had_moved = !covered_.empty();
  for (const auto& [i, pixel] : std::exchange(covered_, {})) seen_[i] = pixel;
  if (!same_surfaces) trace_room(*room_, eye, radiance(), tiles(), seen_);
  auto light_change =
      std::make_shared<LightChange>(eye.camera, depth, picture, room_->voxel_m(), seen_, pixels ? &*pixels : nullptr);
  if (!same_surfaces) {
    light_change->exclude_from(seen_, radiance());
    fill_holes(eye.camera, radiance(), picture.exposure(), tiles(), seen_);
    sharpen_edges(eye.camera, radiance(), picture.exposure(), room_->voxel_m(), tiles(), seen_);
    clips_ = restore_clipped(*room_->illumination(), lamps_, picture, seen_, radiance());
    T_tag_camera_ = T;
    gain_ = frame.color_gain;
  }
  MovedPixels moved;
  const ArrivedSurface arrived(recent_, room_->field(), session_.depth_noise());
  if (depth.any()) {
    moved = moved_surfaces(*room_->illumination(), lamps_, room_->voxel_m(), eye, depth, picture, seen_, &arrived);
    // Where depth sees through fused surface to other fused surface, that is what the pixel shows: a point of noisy
    // depth would be behind it for half of the pixels, and in its shadow.
    for_each_index(moved.size(), kRows * eye.camera.model.width, [&](std::size_t k) {
      auto& [i, pixel] = moved[k];
      const auto u = static_cast<int>(i) % eye.camera.model.width, v = static_cast<int>(i) / eye.camera.model.width;
      if (!seen_[i].known || !(seen_[i].depth_m < pixel.depth_m) || !depth.differs(u, v, seen_[i].depth_m)) return;
      if (auto behind = room_behind(*room_, eye, depth, u, v, seen_[i].depth_m, picture.radiance(i)))
        pixel = std::move(*behind);
    });
    for (const auto& [i, pixel] : moved) {
      covered_.emplace_back(i, std::exchange(seen_[i], pixel));
      set_at(radiance(), i, picture.radiance(i));
    }
  }
  std::shared_ptr<const MovedOccluders> occluders;
  if (!moved.empty()) {
    occluders =
        std::make_shared<const MovedOccluders>(eye, depth, moved, covered_, light_.light().objects().meshes(), arrived);
    light_change->predict(*room_, lamps_, *occluders, covered_);
  }
  light_.set_moved(std::move(occluders), light_change->any() ? std::move(light_change) : nullptr);
  const auto settled = [&](const GBufferPixel& p) {
    return ArrivedSurface::is_settled(*room_->field(), session_.depth_noise(), p.surface.position_m, p.depth_m);
  };
  recent_.add(moved, covered_, settled, frame.time_ns);
  last_depth_ = frame.depth;
  if (!same_view || had_moved || !moved.empty()) {
    detail_ = asked;
    gloss_.reset();
    const capture::CameraModel& model = eye.camera.model;
    change() = capture::Image<float>(model.width, model.height, 3);
    indirect_.emplace(seen_, model, detail_.gather, GatherGrid::Of::even);
    if (any_known_) gloss_.emplace(seen_, model, detail_.gather, GatherGrid::Of::glossy);
    new_view_ = true;
    clock.done("pixels");
  }
  seen_room_ = room_;
}

/// `eye`, `depth`: of the camera's own pixels.
void ViewLighting::see(const CameraRays& eye, const CurrentDepth& depth, int rays, PassClock& clock) {
  const UpdateSubset turn = new_view_ ? UpdateSubset{} : light_.turn();
  new_view_ = true;  // until finish() is done: if anything throws, everything is recomputed
  const std::vector<EmitterSampleSet>& emitters = light_.light().objects().emitter_samples();
  find_change(emitters, rays, turn, clock);
  if (gloss_) {
    gloss_->gather(light_.light(), light_.places(), rays, grey_level(), kGlossSeed, turn);
    const std::vector<Eigen::Array4f> found = gloss_->at_pixels();
    for (std::size_t i = 0; i < seen_.size(); ++i) {
      if (seen_[i].glossy) set_at(change(), i, found[i].head<3>());
    }
    clock.done("gloss");
  }
  const SeenRadiance picture(seen_, radiance(), {room_camera(), eye.camera.T_tag_camera},
                             kGather.seen_voxels * room_->voxel_m());
  objects_ = trace_objects(light_.light(), light_sources(lamps_, emitters), room_pixels(), eye, depth, picture, detail_,
                           grey_level(), std::move(objects_));
  clock.done("object pixels");
}

void ViewLighting::find_change(const std::vector<EmitterSampleSet>& emitters, int rays, const UpdateSubset& turn,
                               PassClock& clock) {
  const std::vector<Eigen::Array4f> hidden = hidden_by_objects(light_.light(), lamps_, seen_, room_camera(), detail_);
  const std::vector<Eigen::Array4f> added = lit_by_objects(light_.light(), emitters, seen_, room_camera(), detail_);
  clock.done("shadows");
  indirect_->gather(light_.light(), light_.places(), rays, grey_level(), kPixelSeed, turn);
  std::vector<Eigen::Array4f> delta = indirect_->at_pixels();
  const LightChange* light_change = light_.light().light_change();
  for_each_index(delta.size(), kRows * change().width, [&](std::size_t i) {
    delta[i] += added[i];
    const GBufferPixel& pixel = seen_[i];
    if (pixel.known && !pixel.glossy)
      delta[i].head<3>() += light_.light().caustic(pixel.surface.position_m, pixel.surface.face);
    delta[i] -=
        light_change && hidden[i].maxCoeff() > 0 ? hidden[i].min(light_change->lamps_now(lamps_, seen_[i])) : hidden[i];
  });
  for_each_pixel(tiles(), change().width, change().height, kRows, [&](int u, int v) {
    const auto i = static_cast<std::size_t>(v * change().width + u);
    const bool even = seen_[i].known && !seen_[i].glossy;
    set_at(change(), i, even ? Rgb(seen_[i].albedo / kPi * delta[i].head<3>()) : Rgb::Zero());
  });
  clock.done("gather");
}

std::shared_ptr<const RelightMaps> ViewLighting::maps(const capture::Image<float>& change,
                                                      const ObjectLayer& shown) const {
  const capture::CameraModel& model = session_.color.model;
  auto maps = std::make_shared<RelightMaps>();
  maps->mask = maps->depth_m = capture::Image<float>(model.width, model.height, 1);
  maps->delta = change;
  maps->albedo = maps->normals = capture::Image<float>(model.width, model.height, 3);
  const Eigen::Vector3f eye_m = T_tag_camera_.topRightCorner<3, 1>(), forward = T_tag_camera_.block<3, 1>(0, 2);
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
      const int x = u + shown.left - objects_.left, y = v + shown.top - objects_.top;
      if (maps->mask.data[i] < 0.5f || x < 0 || y < 0 || x >= objects_.coverage.width || y >= objects_.coverage.height)
        continue;
      const GBufferPixel& surface = objects_.surfaces[objects_.coverage.index(x, y)];
      if (surface.known) tell(i, surface);
    }
  }
  return maps;
}

/// What drawing needs of all that.
void ViewLighting::describe(const CameraRays& eye, const CurrentDepth& depth) {
  found_.T_tag_camera = eye.camera.T_tag_camera;
  found_.room.scale = reduced_ ? reduced_->scale() : 1;
  found_.room.camera = room_camera();
  const capture::CameraModel& model = session_.color.model;
  found_.front = covered_.empty() ? capture::Image<std::uint8_t>()
                                  : front_mask(covered_, room_pixels(), depth, model.width, model.height);
  found_.moved = static_cast<float>(covered_.size()) / static_cast<float>(seen_.size());
  found_.objects = objects_;
  if (reduced_ || views_ == Views::nearby)
    found_.room.surfaces = described(seen_, &SurfaceHit::normal, std::move(found_.room.surfaces));
  if (views_ != Views::nearby) return;
  found_.object_surfaces = described(objects_.surfaces, &SurfaceHit::face, std::move(found_.object_surfaces));
  found_.traced_room = room_;
  found_.lamps = lamps_;
  found_.placed = light_.placed();
  found_.irradiance = light_.light().objects().irradiance_of_vertices();
}

}  // namespace lumigraft::relight
