#include "relight/relighter.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "capture/radiance.h"
#include "relight/approximations.h"
#include "relight/brick_pool.h"
#include "relight/camera_upload.h"
#include "relight/known_room.h"
#include "relight/light_set.h"
#include "relight/mirrors.h"
#include "relight/object_store.h"
#include "relight/passes/ambient.h"
#include "relight/passes/bounce.h"
#include "relight/passes/compose.h"
#include "relight/passes/enclosure.h"
#include "relight/passes/filter.h"
#include "relight/passes/inject.h"
#include "relight/passes/lamp_maps.h"
#include "relight/passes/live_view.h"
#include "relight/passes/lpv.h"
#include "relight/passes/object_view.h"
#include "relight/passes/real_fill.h"
#include "relight/passes/real_view.h"
#include "relight/passes/reflect.h"
#include "relight/passes/resolve.h"
#include "relight/passes/shade.h"
#include "relight/passes/shadow.h"
#include "relight/passes/trace.h"
#include "relight/passes/upsample.h"
#include "relight/passes/virtual_area.h"
#include "relight/passes/virtual_fill.h"
#include "relight/passes/voxel_list.h"
#include "relight/placement.h"
#include "relight/quality.h"
#include "relight/read_back.h"

namespace lumigraft {
namespace {

constexpr int kLeastVolume = 32;
static_assert(kMostSides == shader::kMaxSides);
constexpr float kNearPlane_m = 0.02f;
constexpr int kVertexCones = 9;                // over the hemisphere of a vertex of an object, once
constexpr double kTagWithBorder = 10.0 / 8.0;  // tag36h11: eight modules of black square, one of white on each side

/// Everything that the light volumes depend on besides the field.
struct LightKey {
  std::vector<PlacedObject> objects;
  Placement placement;
  std::shared_ptr<const Illumination> illumination;
  std::shared_ptr<const Enclosure> enclosure;
  int max_lights = 0, bounces = 0, trace_scale = 0, lpv_steps = 0;
  std::string method;

  bool operator==(const LightKey& o) const {
    return objects == o.objects && placement == o.placement && illumination == o.illumination &&
           enclosure == o.enclosure && max_lights == o.max_lights && bounces == o.bounces &&
           trace_scale == o.trace_scale && lpv_steps == o.lpv_steps && method == o.method;
  }
};

}  // namespace

struct Relighter::State {
  std::shared_ptr<gpu::Device> device;
  Session session;
  CameraUpload camera;
  ObjectStore store;
  BrickPool bricks;
  std::vector<StoredModel::Mesh> known_surfaces;
  Mirrors mirrors;

  // Passes, in the order in which they run.
  RealFill real_fill;
  VirtualFill virtual_fill;
  VirtualArea virtual_area;
  VoxelList voxel_list;
  std::unique_ptr<Inject> inject;
  std::unique_ptr<LampMaps> lamp_maps;
  Resolve resolve;
  Filter filter;
  Bounce bounce;
  EnclosureLight enclosure;
  std::unique_ptr<Lpv> lpv;  ///< null where cones carry the change
  ObjectView object_view;
  RealView real_view;
  Shadow shadow;
  Trace trace;
  Upsample upsample;
  Reflect reflect;
  Ambient ambient;
  Shade shade;
  Compose compose;
  std::unique_ptr<LampShadows> lamp_shadows;
  ObjectLight object_light;
  LiveView live_view;

  // What is kept from frame to frame.
  Plan made_for;
  int most_voxels = 1 << 30;  ///< along the edge of volumes: with more the device had no room for them
  std::string why_not_more;
  std::unique_ptr<Volumes> volumes;
  std::unique_ptr<Screen> screen;
  std::optional<LightKey> lit;  ///< empty: volumes are not filled yet
  KnownRoom room;
  std::shared_ptr<const Illumination> illumination;
  int illumination_lights = -1;
  LightSet lights;
  float brightest = 0;  ///< of the environment and of what the camera can tell, W/sr/m²

  State(std::shared_ptr<gpu::Device> d, const Session& s)
      : device(std::move(d)),
        session(s),
        camera(session.color),
        store(*device),
        bricks(*device),
        mirrors(*device),
        real_fill(*device),
        virtual_fill(*device),
        virtual_area(*device),
        voxel_list(*device),
        resolve(*device),
        filter(*device),
        bounce(*device),
        enclosure(*device),
        object_view(*device),
        real_view(*device),
        shadow(*device),
        trace(*device),
        upsample(*device),
        reflect(*device),
        ambient(*device),
        shade(*device),
        compose(*device),
        object_light(*device),
        live_view(*device) {
    for (const RealSurface& surface : session.real_surfaces) {
      if (known_surfaces.size() == shader::kMaxSurfaces) break;
      const std::shared_ptr<const Model> model = load_model(surface.mesh, 'z');
      mirrors.add(*device, *model, surface, static_cast<int>(known_surfaces.size()));
      known_surfaces.push_back(store.upload_mesh(*model));
    }
  }

  void fit(const Plan& plan) {
    const Quality quality = quality_of(plan);
    if (!volumes || made_for.volume != plan.volume) {
      volumes.reset();  // there may be no room for both
      volumes = std::make_unique<Volumes>(*device, plan.volume);
      volumes->mirror_outlines = &mirrors.outlines();
      illumination.reset();
      lit.reset();
    }
    if (!inject || made_for.rsm != plan.rsm) {
      inject = std::make_unique<Inject>(*device, plan.rsm);
      lamp_shadows = std::make_unique<LampShadows>(*device, plan.rsm);
      lit.reset();
    }
    const Quality before = quality_of(made_for);
    if (!lamp_maps || before.lamp_maps != quality.lamp_maps || before.lamp_map_edge != quality.lamp_map_edge) {
      lamp_maps = std::make_unique<LampMaps>(*device, quality.lamp_map_edge, quality.lamp_maps);
      lit.reset();
    }
    if (plan.method == "dlpv") {
      if (!lpv) lpv = std::make_unique<Lpv>(*device);
      lpv->fit(*device, plan.volume, plan.lpv_steps);
    } else {
      lpv.reset();
    }
    const CameraModel& model = session.color.model;
    if (!screen || screen->scale != plan.trace_scale || screen->supersampling != quality.supersampling) {
      // A highlight on gloss is sharp: it is not traced coarsely.
      const int shadow_scale = known_surfaces.empty() ? quality.shadow_scale : 1;
      screen = std::make_unique<Screen>(*device, model.width, model.height, plan.trace_scale, shadow_scale,
                                        quality.ambient_scale, quality.supersampling);
      camera.upload_rays(*device, *screen);
    }
    made_for = plan;
  }

  /// The plan with as large volumes as the device has room for. Throws gpu::GpuError where it has none for anything.
  Plan fit_what_there_is_room_for(Plan plan, std::vector<std::string>* warnings) {
    const int wanted = plan.volume;
    plan.volume = std::min(plan.volume, most_voxels);
    for (;;) {
      try {
        fit(plan);
        break;
      } catch (const gpu::DeviceLost&) {
        throw;
      } catch (const gpu::GpuError& e) {
        if (plan.volume <= kLeastVolume || volumes) throw;
        most_voxels = plan.volume /= 2;
        why_not_more = e.what();
      }
    }
    if (plan.volume < wanted) {
      warnings->push_back("relight: plan.volume " + std::to_string(wanted) + " is too much (" + why_not_more + "), " +
                          std::to_string(plan.volume) + " is taken");
    }
    return plan;
  }

  shader::FrameParams frame_params(const Scene& scene, const Placement& placement, const Plan& plan) {
    const Quality quality = quality_of(plan);
    const CameraModel& model = session.color.model;
    shader::FrameParams p{};
    p.T_tag_camera = scene.pose->T_tag_camera.matrix().cast<float>();
    p.T_camera_tag = scene.pose->T_tag_camera.inverse().matrix().cast<float>();
    p.pinhole << Eigen::Vector4d(model.fx, model.fy, model.cx, model.cy).cast<float>();
    const auto& k = model.distortion;
    p.distortion << Eigen::Vector4d(k[0], k[1], k[2], k[3]).cast<float>();
    p.camera << static_cast<float>(k[4]), camera.exposure(), camera.codes_are_srgb() ? 1 : 0, kNearPlane_m;
    p.picture << model.width, model.height, plan.trace_scale, quality.supersampling;
    p.cascade[0] = placement.cascade[0];
    p.cascade[1] = placement.cascade[1];
    p.virtual_grid = placement.virtual_grid;
    p.grid << plan.volume, placement.virtual_size;
    bricks.describe(p);
    p.sphere << placement.sphere.centre_m, placement.sphere.radius_m;
    p.counts << static_cast<int>(lights.lamps.size()), quality.delta_cones, quality.hemisphere_cones,
        quality.shadow_cones;
    p.counts2 << quality.glossy_cones, kEnvironmentMips, static_cast<int>(known_surfaces.size()), volumes->mips;
    std::copy(lights.lamps.begin(), lights.lamps.end(), p.lamps);
    for (std::size_t i = 0; i < known_surfaces.size(); ++i) {
      const RealSurface& s = session.real_surfaces[i];
      p.surfaces[i].base_color_roughness << s.base_color, s.roughness;
      p.surfaces[i].metallic_specular << s.metallic, s.specular, 0, 0;
    }
    p.probe << scene.illumination->probe_position_m, 0;
    p.enclosure.setZero();
    if (scene.enclosure) {
      const std::vector<Enclosure::Side>& sides = scene.enclosure->sides;
      p.probe.w() = static_cast<float>(sides.size());
      p.enclosure << scene.enclosure->middle_m, 0;
      for (std::size_t i = 0; i < sides.size(); ++i) {
        p.sides[i] << sides[i].normal, sides[i].offset_m;
        p.enclosure.w() += sides[i].measured ? 1.0f : 0.0f;
      }
    }
    p.tag << static_cast<float>(0.5 * session.tag.size_m * kTagWithBorder), 0, 0, 0;
    p.pass_f.x() = quality.least_codes;
    inject->choose_unit(p);
    lamp_maps->choose(*device, p);
    mirrors.describe(p);
    LampShadows::choose_views(p);
    return p;
  }

  void take_lights(const std::shared_ptr<const Illumination>& now, int max_lights) {
    if (illumination == now && illumination_lights == max_lights) return;
    illumination = now;
    illumination_lights = max_lights;
    lights = make_light_set(*now, max_lights);
    const Image<float>& sky = lights.environment.front();
    brightest = std::max(*std::max_element(sky.data.begin(), sky.data.end()), 1 / camera.exposure());
    for (int mip = 0; mip < kEnvironmentMips; ++mip) {
      const Image<float>& level = lights.environment[static_cast<std::size_t>(mip)];
      std::vector<Eigen::half> halves(level.data.size());
      std::transform(level.data.begin(), level.data.end(), halves.begin(),
                     [](float x) { return Eigen::half(std::min(x, 65504.0f)); });
      device->upload(*volumes->environment, mip, std::as_bytes(std::span(halves)));
    }
  }

  /// Whether a frame only looks up what was gathered once; known glossy surfaces want more.
  bool is_live(const shader::FrameParams& params) const {
    return quality_of(made_for).cells && known_surfaces.empty() && LampShadows::possible(params);
  }

  /// The volumes and what is gathered from them once, as far as what they hold has changed. False: nothing has.
  bool light_volumes(gpu::CommandList& list, const shader::FrameParams& params, const LightKey& key, bool new_field) {
    if (!new_field && lit && *lit == key) return false;
    const bool replaced = new_field || !lit || !(lit->placement == key.placement);
    list.begin_pass("volumes");
    if (replaced) real_fill.distances(list, params, bricks, *volumes);
    if (replaced || !(lit->objects == key.objects)) {
      virtual_fill.record(*device, list, params, key.objects, *volumes);
      virtual_area.record(list, params, key.objects, *volumes);
      voxel_list.record(list, params, *volumes);
      real_fill.surfaces(list, params, bricks, *volumes);
      filter.record(list, *volumes->real_radiance);
      bounce.list_cells(list, params, kLeastShare, *volumes);
    }
    // The first resolve must not see what bounced under other lamps.
    for (const auto* texture : {&volumes->gathered_virtual, &volumes->real_irradiance, &volumes->virtual_radiance,
                                &volumes->real_change, &volumes->enclosure_change, &volumes->enclosure_change_before}) {
      list.clear(**texture, {});
    }
    list.begin_pass("lamp maps");
    lamp_maps->record(list, key.objects, store.white());
    list.begin_pass("inject");
    inject->record(list, params, key.objects, store.white(), *volumes);
    resolve_all(list, params);
    shader::FrameParams coarse = params;
    coarse.counts.y() = coarse.counts.z() = quality_of(made_for).voxel_cones;
    if (key.enclosure) {
      list.begin_pass("enclosure");
      enclosure.light(list, coarse, *volumes);
    }
    for (int i = 1; i < key.bounces; ++i) {
      list.begin_pass("bounce of virtual");
      bounce.gather_virtual(list, coarse, *lamp_maps, *volumes);
      if (key.enclosure) {
        resolve_all(list, params);
        list.begin_pass("enclosure");
        enclosure.change(list, coarse, *volumes);
      }
      list.begin_pass("bounce of real");
      gather_real(list, coarse, i - 1, key.bounces);
      resolve_all(list, params);
    }
    if (key.enclosure) {
      list.begin_pass("enclosure");
      enclosure.change(list, coarse, *volumes);
    }
    if (quality_of(made_for).cells || lpv) {
      list.begin_pass("cells");
      gather_real(list, coarse, key.bounces - 1, key.bounces);
    }
    if (is_live(params)) {
      list.begin_pass("lamp shadows");
      lamp_shadows->record(list, params, *lamp_maps, *volumes);
      if (ObjectLight::enough_for(key.objects)) {
        list.begin_pass("object light");
        object_light.record(*device, list, params, kVertexCones, key.objects, *lamp_maps, *volumes);
      }
    }
    lit = key;
    return true;
  }

  void gather_real(gpu::CommandList& list, const shader::FrameParams& params, int round, int rounds) {
    if (lpv) {
      lpv->gather_real(list, params, brightest, round, rounds, *volumes);
    } else {
      bounce.gather_real(list, params, kChangeCones, round + 1 < rounds, *lamp_maps, *volumes);
    }
  }

  void resolve_all(gpu::CommandList& list, const shader::FrameParams& params) const {
    resolve.record(list, params, *volumes);
    filter.record(list, *volumes->virtual_radiance);
    filter.record(list, *volumes->real_change);
  }

  void draw_picture(gpu::CommandList& list, const shader::FrameParams& params, const std::vector<PlacedObject>& objects,
                    const Plan& plan) const {
    const Quality quality = quality_of(plan);
    // Passes fill chosen blocks alone; nothing of the last frame may show in the others.
    for (const gpu::Texture* stale :
         {screen->real_position.get(), screen->real_normal.get(), screen->object_surface.get(), screen->shadowed.get(),
          screen->direct_lost.get(), screen->traced.get(), screen->indirect.get(), screen->object_irradiance.get()}) {
      list.clear(*stale, {});
    }
    list.begin_pass("views");
    object_view.draw(list, params, objects, quality.simple_models, store.white(), *screen);
    if (!known_surfaces.empty()) object_view.draw_known(list, params, known_surfaces, store.white(), *screen);
    list.begin_pass("real view");
    if (quality.cells) {
      real_view.from_volumes(list, params, quality.least_codes, *volumes, *screen);
    } else {
      real_view.from_bricks(list, params, quality.least_codes, bricks, *screen);
    }
    list.begin_pass("object view");
    object_view.resolve(list, params, *screen);
    list.begin_pass("shadow");
    shadow.record(list, params, !known_surfaces.empty(), *lamp_maps, *volumes, *screen);
    if (screen->shadow_scale > 1)
      upsample.record(list, params, *screen, screen->tiles->shaded(), *screen->shadowed, *screen->direct_lost,
                      screen->shadow_scale, 1);
    if (!quality.cells && lpv) {
      list.begin_pass("look up");
      lpv->look_up(list, params, *volumes, *screen);
    } else if (!quality.cells) {
      list.begin_pass("trace");
      trace.record(list, params, quality.change_cones, *volumes, *screen);
      list.begin_pass("upsample");
      upsample.record(list, params, *screen, screen->tiles->changed(), *screen->traced, *screen->indirect,
                      plan.trace_scale, quality.window);
    }
    if (!known_surfaces.empty()) {
      list.begin_pass("reflect");
      reflect.record(list, params, *volumes, *screen);
    }
    light_objects(list, params);
    list.begin_pass("compose");
    compose.record(list, params, *screen);
  }

  void draw_live(gpu::CommandList& list, const shader::FrameParams& params, const std::vector<PlacedObject>& objects,
                 const Plan& plan) const {
    const bool matt = ObjectLight::enough_for(objects);
    list.begin_pass("views");
    if (matt) {
      live_view.draw_objects(list, params, objects, object_light, store.white(), *screen);
    } else {
      object_view.draw(list, params, objects, quality_of(plan).simple_models, store.white(), *screen);
      list.begin_pass("object view");
      live_view.place(list, params, *volumes, *screen);
      object_view.resolve(list, params, *screen);
      light_objects(list, params);
    }
    list.begin_pass("compose");
    live_view.compose(list, params, *lamp_shadows, matt, *volumes, *screen);
  }

  void light_objects(gpu::CommandList& list, const shader::FrameParams& params) const {
    list.begin_pass("ambient");
    ambient.record(list, params, *volumes, *screen);
    list.begin_pass("shade");
    shade.record(list, params, *lamp_maps, *volumes, *screen);
  }
};

Relighter::Relighter(std::shared_ptr<gpu::Device> device, const Session& session)
    : state_(std::make_unique<State>(std::move(device), session)) {}
Relighter::~Relighter() = default;

RelitPicture Relighter::relight(const FrameSet& frame, const Scene& scene, const Exhibit& exhibit, const Plan& asked,
                                bool with_maps) {
  State& s = *state_;
  RelitPicture result;
  result.plan = asked;
  s.camera.take(frame.color);

  std::string missing;
  const bool visible = std::any_of(exhibit.objects.begin(), exhibit.objects.end(),
                                   [](const VirtualObject& o) { return o.visible && o.model; });
  if (!visible)
    missing = "no visible object";
  else if (!scene.pose)
    missing = "no pose";
  else if (!scene.illumination)
    missing = "no light is known yet";
  else if (!scene.field)
    missing = "no geometry is known yet";
  if (missing.empty()) {
    try {
      result.plan = s.fit_what_there_is_room_for(asked, &result.warnings);
    } catch (const gpu::DeviceLost&) {
      throw;
    } catch (const gpu::GpuError& e) {
      missing = e.what();
    }
  }
  if (!missing.empty()) {
    result.warnings.push_back("relight: " + missing + ", the camera picture passes through");
    result.srgb = s.camera.coded();
    return result;
  }

  const Plan& plan = result.plan;
  const std::vector<PlacedObject> objects = s.store.place(exhibit, static_cast<double>(frame.time_ns) * 1e-9);
  std::vector<PlacedBounds> bounds;
  for (const auto& object : objects) bounds.push_back(object.bounds);
  const Placement placement = place_volumes(bounds, plan.volume);
  for (const std::string& line : approximations(exhibit, objects, placement, scene)) {
    result.warnings.push_back("relight: " + line);
  }
  s.volumes->fit_virtual(*s.device, placement.virtual_size);
  s.take_lights(scene.illumination, plan.max_lights);

  // Bricks around what cones can reach, and half as far again for the pixels from which they start.
  const float edge = static_cast<float>(plan.volume) * placement.cascade[1].w();
  const Eigen::Vector3f reach = Eigen::Vector3f::Constant(0.75f * edge);
  s.room.follow(scene);
  const bool new_field = s.bricks.update(s.room.field(), s.room.albedo(),
                                         {placement.sphere.centre_m - reach, placement.sphere.centre_m + reach});
  const shader::FrameParams params = s.frame_params(scene, placement, plan);
  const bool live = s.is_live(params), full = !live || with_maps;  // maps are those of the full view
  s.camera.upload(*s.device, frame, full, *s.screen);

  auto list = s.device->begin();
  const bool lit_anew = s.light_volumes(*list, params,
                                        {objects, placement, scene.illumination, scene.enclosure, plan.max_lights,
                                         plan.bounces, plan.trace_scale, plan.lpv_steps, plan.method},
                                        new_field);
  if (lit_anew && live) {  // which blocks are in shadow depends on it
    result.passes = s.device->submit(*list);
    s.lamp_shadows->read(*s.device, params);
    list = s.device->begin();
  }
  const bool depth_fits = frame.depth && frame.depth->depth_m.data.size() * 2 == s.camera.rays().size();
  s.screen->tiles->choose(
      *s.device, params, {s.camera.rays(), depth_fits ? &frame.depth->depth_m : nullptr, s.camera.coded()}, objects,
      {quality_of(plan).least_codes, !s.known_surfaces.empty(), live ? s.lamp_shadows.get() : nullptr, with_maps});
  if (full) s.draw_picture(*list, params, objects, plan);
  if (live) s.draw_live(*list, params, objects, plan);
  const std::vector<gpu::PassTime> passes = s.device->submit(*list);
  result.passes.insert(result.passes.end(), passes.begin(), passes.end());
  result.srgb = read_picture(*s.device, *s.screen, s.camera.coded(), live);
  if (with_maps) result.maps = read_maps(*s.device, *s.screen);
  return result;
}

}  // namespace lumigraft
