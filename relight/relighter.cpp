#include "relight/relighter.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <numbers>
#include <optional>
#include <utility>

#include "reconstruct/math/tag_family.h"
#include "relight/amortized_light_update.h"
#include "relight/camera_view.h"
#include "relight/compose/gone_surfaces.h"
#include "relight/compose/motion_blur.h"
#include "relight/compose/parameters.h"
#include "relight/compose/sampled_depth.h"
#include "relight/gather/moved_surfaces.h"
#include "relight/gather/parameters.h"
#include "relight/objects/placement.h"
#include "relight/passes/lamps/lamp_maps.h"
#include "relight/passes/screen/lamp_shadows.h"
#include "relight/quality.h"
#include "relight/quality_warnings.h"
#include "relight/scene_update_throttle.h"
#include "relight/upload/brick_pool.h"
#include "relight/upload/light_set.h"
#include "relight/upload/mirrors.h"
#include "relight/upload/object_store.h"
#include "relight/upload/parameters.h"
#include "relight/upload/transmittance.h"

namespace lumigraft::relight {
namespace {

static_assert(reconstruct::kMaxSides == shader::kMaxSides);

GlossyBounds bounds_of(const Model& model, const capture::RealSurface& surface) {
  GlossyBounds bounds;
  for (const Eigen::Vector3f& p : model.positions_m) bounds.box.extend(p);
  bounds.box.min().array() -= kRelight.glossy_margin_m;
  bounds.box.max().array() += kRelight.glossy_margin_m;
  bounds.alpha = surface.roughness * surface.roughness;
  return bounds;
}

/// Maximum |x, y| / z for which vertices are projected with distortion: up to there it does not fold back in any
/// direction. Points farther out than kWidestLens are in no image, and distortion grows there by the seventh power.
float lens_tangent(const capture::CameraModel& lens) {
  constexpr double kWidestLens = 2, kUndistorted = 1e3;
  if (lens.distortion == decltype(lens.distortion){}) return kUndistorted;
  const auto unfolded = [&](double radius) {
    constexpr int kAzimuths = 32;  // tangential distortion folds back at a radius that depends on the direction
    for (int i = 0; i < kAzimuths; ++i) {
      const double phi = 2 * std::numbers::pi * i / kAzimuths;
      if (!lens.project({radius * std::cos(phi), radius * std::sin(phi), 1})) return false;
    }
    return true;
  };
  if (unfolded(kWidestLens)) return kWidestLens;
  double low = 0, high = kWidestLens;
  for (int i = 0; i < 40; ++i) {
    const double middle = 0.5 * (low + high);
    (unfolded(middle) ? low : high) = middle;
  }
  return static_cast<float>(low);
}

/// Coefficients of CurrentDepth::allowed_m() in depth without its voxel: noise is quadratic.
Eigen::Vector4f noise_of_depth(const capture::DepthNoise& noise) {
  const auto at = [&](float depth_m) { return kCompose.moved_sigmas * noise.axial_sigma_m(depth_m); };
  const float square = 0.5f * (at(2) - 2 * at(1) + at(0));
  return {at(0), at(1) - at(0) - square, square, 0};
}

}  // namespace

struct Relighter::State {
  std::shared_ptr<gpu::Device> device;
  capture::Session session;
  std::shared_ptr<const UploadModels> models;
  double print_m;  ///< edge of the tag including its paper
  ObjectStore store;
  BrickPool bricks;
  std::vector<StoredModel::Mesh> known_surfaces;
  std::vector<GlossyBounds> glossy;  ///< bounds of glossy ones
  std::string too_many_surfaces;     ///< non-empty: the session lists more of them than can be rendered
  Mirrors mirrors;

  // Passes in execution order.
  AmortizedLightUpdate light;
  std::unique_ptr<LampMaps> lamp_maps;
  std::unique_ptr<LampShadows> lamp_shadows;  ///< null if light is traced per pixel
  CameraView view;

  // State kept between frames.
  Plan made_for;
  int max_voxels = 1 << 30;  ///< maximum edge of the volumes; larger ones did not fit in device memory
  std::string why_not_more;
  std::optional<LightKey> directly_lit;  ///< of which the lamp maps and all derived from them are
  SceneUpdateThrottle room;
  std::shared_ptr<const reconstruct::Illumination> illumination;
  int illumination_lights = -1;
  LightSet lights;
  std::vector<ReferenceMesh> traced_objects;  ///< of `traced`
  std::unique_ptr<const Meshes> traced;       ///< the objects, for rays; null: none was needed yet
  std::optional<SampledDepth> sampled_depth;  ///< in which what moved or is gone is found
  RecentlyMoved recent;
  GoneSurfaces gone;
  GoneCells gone_cells;
  int max_lamps = 1;  ///< for which there is room: a power of two, so that it rarely changes
  const float widest_tangent;
  bool shadows_due = false;  ///< of lamps: what appeared or disappeared has not changed them yet
  bool drawn_live = false;   ///< the last frame was, in the live setting
  std::int64_t last_time_ns = 0;
  double frame_ms = 33;  ///< between the last frames
  float brightest = 0;   ///< highest radiance of the environment and of the camera's range, W/sr/m²

  State(std::shared_ptr<gpu::Device> d, const capture::Session& s, std::shared_ptr<const UploadModels> m)
      : device(std::move(d)),
        session(s),
        models(std::move(m)),
        print_m(reconstruct::print_edge_m(s.tag)),
        store(*device),
        bricks(*device),
        mirrors(*device),
        light(*device),
        view(*device, session.color, session.depth_noise()),
        gone_cells(*device, kCompose.gone_max_cells),
        widest_tangent(lens_tangent(session.color.model)) {
    for (const capture::RealSurface& surface : session.real_surfaces) {
      if (known_surfaces.size() == shader::kMaxSurfaces) {
        too_many_surfaces = std::to_string(session.real_surfaces.size()) +
                            " [[real_surface]] are configured, allowed: " + std::to_string(shader::kMaxSurfaces) +
                            "; from \"" + surface.name + "\" on they are rendered as matt";
        break;
      }
      const std::shared_ptr<const Model> model = load_model(surface.mesh, 'z');
      mirrors.add(*device, *model, surface, static_cast<int>(known_surfaces.size()));
      known_surfaces.push_back(store.upload_mesh(*model));
      glossy.push_back(bounds_of(*model, surface));
    }
  }

  void fit(const Plan& plan) {
    const Quality quality = quality_of(plan);
    const int lamps = std::max(max_lamps, static_cast<int>(std::bit_ceil(lights.lamps.size())));
    const bool more_lamps = lamps > max_lamps;
    light.fit(plan, mirrors.outlines(), gone_cells.buffer());
    if (!quality.cells) {
      lamp_shadows.reset();  // shadows are traced
    } else if (!lamp_shadows || more_lamps || made_for.rsm != plan.rsm) {
      // They cover more than the objects alone.
      lamp_shadows = std::make_unique<LampShadows>(*device, plan.rsm + plan.rsm / 4, lamps);
      directly_lit.reset();
    }
    const Quality before = quality_of(made_for);
    if (!lamp_maps || more_lamps || before.lamp_maps != quality.lamp_maps ||
        before.lamp_map_edge != quality.lamp_map_edge) {
      lamp_maps = std::make_unique<LampMaps>(*device, quality.lamp_map_edge, quality.lamp_maps, lamps);
      directly_lit.reset();
    }
    view.fit(plan, lamps, !known_surfaces.empty());
    max_lamps = lamps;
    made_for = plan;
  }

  /// Reduces the volumes' size for the next attempt; false if there is no smaller one.
  bool no_room_for(int volume, const gpu::GpuError& e) {
    if (volume <= kRelight.min_volume) return false;
    max_voxels = volume / 2;
    why_not_more = std::string(e.what()) + "; " + gpu::megabytes_text(device->holdings().max_bytes()) + " held";
    return true;
  }

  /// The plan with the largest volumes that fit in device memory. Throws gpu::GpuError if none fit.
  Plan fit_what_there_is_room_for(Plan plan, std::vector<std::string>* warnings) {
    const int wanted = plan.volume;
    plan.volume = std::min(plan.volume, max_voxels);
    for (;;) {
      try {
        fit(plan);
        break;
      } catch (const gpu::DeviceLost&) {
        throw;
      } catch (const gpu::GpuError& e) {
        if (light.any_room() || !no_room_for(plan.volume, e)) throw;
        plan.volume = max_voxels;
      }
    }
    if (plan.volume < wanted) {
      warnings->push_back("relight: plan.volume " + std::to_string(wanted) + " is too large (" + why_not_more + "), " +
                          std::to_string(plan.volume) + " is used");
    }
    return plan;
  }

  /// Differences between this frame and the fused room that may occlude lamps: what depth shows and the room does not,
  /// the reverse in the light volumes, and shadows that the camera sees.
  void find_occluders(const capture::FrameSet& frame, const reconstruct::Scene& scene, const Exhibit& exhibit,
                      shader::FrameParams& params) {
    lamp_maps->observe(*device, params, scene.shadows, lights.lamp_ids);
    const capture::CameraModel& camera = session.color.model;
    const capture::Image<float>* depth_m = depth_of(frame, camera);
    if (depth_m == nullptr) {
      gone_cells.take(*device, {}, params);
      lamp_maps->choose(*device, params);
      return;
    }
    // Two samples per voxel at the objects: the fused room has nothing finer to differ from.
    const float distance_m =
        std::max((params.sphere.head<3>() - params.T_tag_camera.topRightCorner<3, 1>()).norm(), kRelight.near_plane_m);
    const float voxel_px = scene.field->voxel_m * static_cast<float>(camera.fx) / distance_m;
    const int step = std::clamp(static_cast<int>(voxel_px / 2), 1, kCompose.moved_max_edge_px);
    if (!sampled_depth || sampled_depth->step() != step) sampled_depth.emplace(camera, step);
    const CurrentDepth depth(sampled_depth->rays(), &sampled_depth->sample(*depth_m), scene.field->voxel_m,
                             session.depth_noise());
    const CameraRays eye{sampled_depth->rays(), {sampled_depth->model(), Eigen::Isometry3f(params.T_tag_camera)}};
    const auto may_matter = [&](const Eigen::Vector3f& p_m) { return LampMaps::may_occlude(params, p_m); };
    // Shadow cones find the volumes' surfaces to half a voxel.
    const float cell_m = params.cascade[shader::kCascades - 1].w() / 2;
    const ArrivedSurface arrived(recent, scene.field, session.depth_noise());
    const GoneSpace gone_now(eye.camera, depth, arrived);
    gone_cells.take(
        *device,
        gone.find(
            *room.field(), [&](const Eigen::Vector3f& p_m) { return gone_now.contains(p_m); }, cell_m, may_matter),
        params);
    const MovedInField moved = moved_in_field(eye, depth, *scene.field, arrived, may_matter,
                                              [&]() -> const Meshes& { return traced_at(exhibit, frame.time_ns); });
    const auto settled = [&](const GBufferPixel& p) {
      return ArrivedSurface::is_settled(*scene.field, session.depth_noise(), p.surface.position_m, p.depth_m);
    };
    recent.add(moved.now, moved.fused, settled, frame.time_ns);
    lamp_maps->choose(*device, params, moved.shell.get());
  }

  const Meshes& traced_at(const Exhibit& exhibit, std::int64_t time_ns) {
    std::vector<ReferenceMesh> now = reference_objects_of(exhibit, 1e-9 * static_cast<double>(time_ns));
    if (!traced || !same_meshes(traced_objects, now)) {
      traced_objects = std::move(now);
      traced = std::make_unique<const Meshes>(traced_objects, nullptr);
    }
    return *traced;
  }

  MotionBlur motion_blur(const Exhibit& exhibit, const std::vector<PlacedObject>& objects,
                         const shader::FrameParams& params, std::int64_t time_ns) {
    std::vector<ObjectMotion> motions = motions_while_exposed(session.color, exhibit, time_ns);
    if (motions.empty()) return {};
    std::vector<Eigen::Vector4f> spheres;
    for (const PlacedObject& object : objects) {
      const BoundingSphere& around = object.bounds.sphere;
      spheres.emplace_back(around.centre_m.x(), around.centre_m.y(), around.centre_m.z(), around.radius_m);
    }
    return {std::move(motions),
            {view.pixel_rays(),
             {session.color.model, Eigen::Isometry3f(params.T_tag_camera)},
             std::move(spheres),
             [this, &exhibit, time_ns]() -> const Meshes& { return traced_at(exhibit, time_ns); }}};
  }

  shader::FrameParams frame_params(const capture::FrameSet& frame, const reconstruct::Scene& scene,
                                   const Eigen::Isometry3d& T_tag_camera, const Exhibit& exhibit,
                                   const std::vector<PlacedObject>& objects, const Placement& placement,
                                   const Plan& plan) {
    Eigen::Vector3f emission = Eigen::Vector3f::Zero();  // of the brightest object, by channel
    shader::FrameParams p{};
    p.emission.setZero();
    for (const PlacedObject& object : objects) {
      emission = emission.cwiseMax(object.emission());
      // A convex surface shows a quarter of its area in the mean of all directions (Cauchy 1832), any other less.
      const float area_m2 = object.stored->area_m2 * object.T_tag_model.linear().col(0).squaredNorm();
      const float sphere_m2 = std::numbers::pi_v<float> * object.bounds.sphere.radius_m * object.bounds.sphere.radius_m;
      p.emission.head<3>() += std::min(area_m2 / 4, sphere_m2) * object.mean_emission();
    }
    describe_glass(objects, p);
    const Quality quality = quality_of(plan);
    const capture::CameraModel& model = session.color.model;
    p.T_tag_camera = T_tag_camera.matrix().cast<float>();
    p.T_camera_tag = T_tag_camera.inverse().matrix().cast<float>();
    p.pinhole << Eigen::Vector4d(model.fx, model.fy, model.cx, model.cy).cast<float>();
    const auto& k = model.distortion;
    p.distortion << Eigen::Vector4d(k[0], k[1], k[2], k[3]).cast<float>();
    p.camera << static_cast<float>(k[4]), kRelight.near_plane_m, 0, 0;
    p.exposure << view.camera().exposure().matrix(), (view.camera().exposure() * emission.array()).maxCoeff();
    p.lens << widest_tangent, 0, 0, 0;
    p.picture << model.width, model.height, plan.trace_scale, quality.supersampling;
    p.cascade[0] = placement.cascade[0];
    p.cascade[1] = placement.cascade[1];
    p.virtual_grid = placement.virtual_grid;
    p.grid << plan.volume, placement.virtual_size;
    bricks.describe(p);
    p.depth_noise = noise_of_depth(session.depth_noise());
    p.sphere << placement.sphere.centre_m, placement.sphere.radius_m;
    p.counts << static_cast<int>(lights.lamps.size()), quality.delta_cones, quality.hemisphere_cones,
        quality.shadow_cones;
    p.counts2 << quality.glossy_cones, kUpload.environment_mips, static_cast<int>(known_surfaces.size()),
        light.room().volumes.mips;
    std::copy(lights.lamps.begin(), lights.lamps.end(), p.lamps);
    for (std::size_t i = 0; i < known_surfaces.size(); ++i) {
      const capture::RealSurface& s = session.real_surfaces[i];
      p.surfaces[i].base_color_roughness << s.base_color, s.roughness;
      p.surfaces[i].metallic_specular << s.metallic, s.specular, 0, 0;
    }
    const auto kept = static_cast<std::size_t>(plan.sh_bands * plan.sh_bands);
    for (std::size_t i = 0; i < scene.illumination->environment_sh.size(); ++i) {
      if (i < kept)
        p.sh[i] << scene.illumination->environment_sh[i], 0;
      else
        p.sh[i].setZero();
    }
    p.probe << scene.illumination->probe_position_m, 0;
    p.enclosure.setZero();
    if (scene.enclosure) {
      const std::vector<reconstruct::Enclosure::Side>& sides = scene.enclosure->sides;
      p.probe.w() = static_cast<float>(sides.size());
      p.enclosure << scene.enclosure->middle_m, 0;
      for (std::size_t i = 0; i < sides.size(); ++i) {
        p.sides[i] << sides[i].normal, sides[i].offset_m;
        p.enclosure.w() += sides[i].measured ? 1.0f : 0.0f;
      }
    }
    p.tag << static_cast<float>(0.5 * print_m), 0, 0, 0;
    p.pass_f.x() = quality.min_code_change;
    light.passes().inject().choose_unit(objects, p);
    find_occluders(frame, scene, exhibit, p);
    mirrors.describe(p);
    LampShadows::choose_views(p);
    return p;
  }

  void take_lights(const std::shared_ptr<const reconstruct::Illumination>& now, int max_lights) {
    if (illumination == now && illumination_lights == max_lights) return;
    illumination = now;
    illumination_lights = max_lights;
    lights = make_light_set(*now, max_lights);
    const capture::Image<float>& sky = lights.environment.front();
    brightest = std::max(*std::max_element(sky.data.begin(), sky.data.end()), 1 / view.camera().exposure().minCoeff());
  }

  /// Whether a frame only looks up light that was gathered before, except on glossy surfaces of known material.
  bool is_live(const shader::FrameParams& params) const {
    return quality_of(made_for).cells && (known_surfaces.empty() || made_for.method == "dvct") &&
           LampShadows::possible(params);
  }

  /// Direct light of lamps on the objects, and their shadows.
  void light_directly(gpu::CommandList& list, const shader::FrameParams& params, const LightKey& key, bool on_objects,
                      bool shadows) {
    if (is_live(params)) {
      const LightVolumeState& lit = light.room();
      if (shadows) {
        list.begin_pass("lamp shadows");
        lamp_shadows->record(list, params, *lamp_maps, lit);
      }
      if (on_objects && ObjectLight::enough_for(key.objects)) {
        list.begin_pass("object light");
        light.passes().object_light().record(*device, list, params, light.older(), light.newer(), light.newer_weight(),
                                             key.objects, *lamp_maps, lit.volumes);
      }
    }
    directly_lit = key;
  }

  void submit(gpu::CommandList& list, RelitPicture* result) const {
    const std::vector<gpu::PassTime> passes = device->submit(list);
    result->passes.insert(result->passes.end(), passes.begin(), passes.end());
  }

  /// The frame before the light around new objects is known.
  RelitPicture wait_for_light(gpu::CommandList& list, RelitPicture result) {
    submit(list, &result);
    pass_through("light around the objects is being gathered", &result);
    result.srgb = *view.camera().coded();
    drawn_live = false;
    return result;
  }

  /// For deferred updates of light; none while the shadows of lamps are updated, more while nothing is drawn.
  double budget_ms() const {
    if (lamp_shadows && lamp_shadows->updating_receivers()) return 0;
    return std::max((drawn_live ? kRelight.frame_fraction : 1) * frame_ms, kRelight.min_budget_ms);
  }

  void take_time(std::int64_t time_ns) {
    const double since_ms = 1e-6 * static_cast<double>(time_ns - std::exchange(last_time_ns, time_ns));
    if (since_ms >= 0 && since_ms < kRelight.max_frame_ms) frame_ms = since_ms;
  }

  /// Whether indirect light may lag behind: only if this is not visible on the objects themselves or in mirrors.
  bool may_lag(const shader::FrameParams& params, const std::vector<PlacedObject>& objects) const {
    return is_live(params) && ObjectLight::enough_for(objects) &&
           std::all_of(glossy.begin(), glossy.end(), [](const GlossyBounds& g) { return g.alpha >= kRelight.sharp; }) &&
           std::all_of(params.lamps, params.lamps + params.counts.x(),
                       [](const shader::Lamp& lamp) { return lamp.intensity.w() > 0; });
  }
};

Relighter::Relighter(std::shared_ptr<gpu::Device> device, const capture::Session& session,
                     std::shared_ptr<const UploadModels> models)
    : state_(std::make_unique<State>(std::move(device), session, std::move(models))) {}
Relighter::~Relighter() = default;

RelitPicture Relighter::relight(const capture::FrameSet& frame, const reconstruct::Scene& scene, const Exhibit& wanted,
                                const Plan& asked, bool with_maps) {
  State& s = *state_;
  RelitPicture result;
  result.plan = asked;
  s.view.take(frame, scene, asked.look == "camera");
  s.take_time(frame.time_ns);
  result.camera = s.view.camera().coded();
  std::vector<std::string> preparing;
  Exhibit exhibit = s.models ? s.store.ready(wanted, *s.models, &preparing) : wanted;
  const double time_s = static_cast<double>(frame.time_ns) * 1e-9;
  for (VirtualObject& object : exhibit.objects) object.visible = object.drawn(time_s);

  const bool visible = std::ranges::any_of(exhibit.objects, &VirtualObject::visible);
  std::string missing = what_is_missing(scene, visible, preparing);
  if (missing.empty()) {
    s.take_lights(scene.illumination, asked.max_lights);
    try {
      result.plan = s.fit_what_there_is_room_for(asked, &result.warnings);
    } catch (const gpu::DeviceLost&) {
      throw;
    } catch (const gpu::GpuError& e) {
      missing = e.what();
    }
  }
  if (!missing.empty()) {
    s.drawn_live = false;
    pass_through(missing, &result);
    result.srgb = *s.view.camera().coded();
    return result;
  }

  const Plan& plan = result.plan;
  const std::vector<PlacedObject> objects = s.store.place(exhibit, time_s);
  std::vector<PlacedBounds> bounds;
  for (const auto& object : objects) bounds.push_back(object.bounds);
  const Placement placement = place_volumes(bounds, plan.volume, kRelight.max_voxel * scene.field->truncation_m);
  for (const std::string& line : quality_warnings(exhibit, objects, placement, scene)) {
    result.warnings.push_back("relight: " + line);
  }
  if (!preparing.empty()) result.warnings.push_back("relight: " + being_prepared(preparing));
  if (!s.too_many_surfaces.empty()) result.warnings.push_back("relight: " + s.too_many_surfaces);
  s.room.follow(scene);
  bool moved = false;
  const float nearest_m = (placement.sphere.centre_m - scene.pose->T_tag_camera.translation().cast<float>()).norm() -
                          placement.sphere.radius_m;
  shader::FrameParams params = s.frame_params(
      frame, scene, s.view.hold(scene.pose->T_tag_camera, std::max(nearest_m, kRelight.min_still_m), &moved), exhibit,
      objects, placement, plan);

  const LightKey key{objects, placement, scene.illumination, scene.enclosure, s.room.field(), s.room.albedo(), plan};
  const bool live = s.is_live(params);
  const bool directly_anew = !s.directly_lit || !(*s.directly_lit == key);
  auto list = s.device->begin();
  if (directly_anew) {
    list->begin_pass("lamp maps");
    s.lamp_maps->record(*list, objects, quality_of(plan).simple_models, s.store.white());
  }
  AmortizedLightUpdate::Done light;
  try {
    light = s.light.advance(
        *list,
        {params, key, s.lights, *s.lamp_maps, s.brightest, live, !with_maps && s.may_lag(params, objects),
         s.store.white(), s.models && live && !with_maps ? std::optional(s.budget_ms()) : std::nullopt},
        s.bricks);
  } catch (const gpu::DeviceLost&) {
    throw;
  } catch (const gpu::GpuError& e) {
    if (!s.no_room_for(plan.volume, e)) throw;
    return relight(frame, scene, wanted, asked, with_maps);
  }
  result.passes = std::move(light.passes);
  const bool occluded_anew = s.lamp_maps->moved_anew() || s.gone_cells.changed();
  if (s.lamp_maps->moved_anew()) {
    list->begin_pass("moved surfaces");
    s.lamp_maps->record_moved(*list);
  }
  // What is drawn already continues to be drawn, if coarsely.
  if (!s.light.any_light() || (!s.drawn_live && !s.light.reaches(objects)))
    return s.wait_for_light(*list, std::move(result));
  if (!s.light.why_no_rounds().empty()) {
    result.warnings.push_back(
        "relight: updates of indirect light are not spread over frames: device memory is too small (" +
        s.light.why_no_rounds() + ")");
  }
  s.bricks.describe(params);
  const shader::FrameParams& lit = s.light.room().params;  // the objects may have moved inside the volumes since
  std::copy_n(lit.cascade, shader::kCascades, params.cascade);
  params.virtual_grid = lit.virtual_grid;
  params.grid = lit.grid;
  const bool objects_anew = light.changed || directly_anew;
  bool lit_anew = objects_anew, shadows_wait = false;
  if (s.models && live) {
    if (!s.lamp_shadows->update_receivers(*s.device, *list, params, s.light.room()) && !s.drawn_live)
      return s.wait_for_light(*list, std::move(result));
    lit_anew = lit_anew || s.lamp_shadows->other_receivers() || s.shadows_due;
    // Shadows follow in the next frame: this one draws what appeared or what it hid.
    shadows_wait = s.drawn_live && s.directly_lit && !same_models(s.directly_lit->objects, objects) &&
                   !s.lamp_shadows->other_receivers();
  }
  const bool shadows_anew = (lit_anew || s.gone_cells.changed()) && !shadows_wait;
  if (lit_anew || occluded_anew) s.light_directly(*list, params, key, objects_anew || occluded_anew, shadows_anew);
  s.shadows_due = shadows_wait;
  const MotionBlur motion =
      asked.look == "camera" ? s.motion_blur(exhibit, objects, params, frame.time_ns) : MotionBlur();
  const CameraView::View view{
      params, objects, s.known_surfaces, s.glossy, s.store.white(), plan, moved || lit_anew || occluded_anew, with_maps,
      live,   motion};
  const CameraView::Light shown{s.light, *s.lamp_maps, s.bricks};
  s.drawn_live = live;
  if (!live) {
    s.view.show_full(frame, view, shown, *list, &result);
    return result;
  }
  if (light.recorded || lit_anew || occluded_anew) s.submit(*list, &result);
  if (shadows_anew) s.lamp_shadows->read(*s.device, params);  // the selection of shadowed blocks depends on it
  s.view.show_live(frame, view, shown, *s.lamp_shadows, &result);
  return result;
}

}  // namespace lumigraft::relight
