#include "relight/camera_view.h"

#include <algorithm>

#include "relight/compose/add_noise.h"
#include "relight/compose/composer.h"
#include "relight/compose/foreground_matte.h"
#include "relight/compose/read_tiles.h"
#include "relight/compose/soften.h"
#include "relight/compose/subsample_chroma.h"

namespace lumigraft::relight {
namespace {

capture::Image<float> read_floats(gpu::Device& device, const gpu::Texture& texture, int first, int channels) {
  const std::vector<std::byte> bytes = device.download(texture);
  const bool halves = texture.desc().format == gpu::Format::rgba16_float;
  capture::Image<float> image(texture.desc().width, texture.desc().height, channels);
  const std::size_t pixels = static_cast<std::size_t>(image.width) * image.height;
  const auto* half = reinterpret_cast<const Eigen::half*>(bytes.data());
  const auto* full = reinterpret_cast<const float*>(bytes.data());
  for (std::size_t i = 0; i < pixels; ++i) {
    for (int c = 0; c < channels; ++c) {
      const std::size_t at = 4 * i + static_cast<std::size_t>(first + c);
      image.data[i * channels + c] = halves ? static_cast<float>(half[at]) : full[at];
    }
  }
  return image;
}

/// Where an object covers a pixel, the maps describe the object.
std::shared_ptr<const RelightMaps> read_maps(gpu::Device& device, const Screen& screen,
                                             const capture::Image<float>& coverage) {
  auto maps = std::make_shared<RelightMaps>();
  maps->albedo = read_floats(device, *screen.real_albedo, 0, 3);
  maps->normals = read_floats(device, *screen.real_normal, 0, 3);
  maps->depth_m = read_floats(device, *screen.real_position, 3, 1);
  for (float& z : maps->depth_m.data) z = std::max(z, 0.0f);  // negative: estimated
  maps->delta = read_floats(device, *screen.delta, 0, 3);
  maps->mask = coverage;
  const capture::Image<float> base = read_floats(device, *screen.object_base, 0, 3);
  const capture::Image<float> normal = read_floats(device, *screen.object_normal, 0, 3);
  const capture::Image<float> z = read_floats(device, *screen.object_surface, 0, 1);
  for (std::size_t i = 0; i < maps->mask.data.size(); ++i) {
    if (maps->mask.data[i] < 0.5f) continue;
    maps->depth_m.data[i] = z.data[i];
    for (std::size_t c = 0; c < 3; ++c) {
      maps->albedo.data[3 * i + c] = base.data[3 * i + c];
      maps->normals.data[3 * i + c] = normal.data[3 * i + c];
    }
  }
  return maps;
}

}  // namespace

CameraView::CameraView(gpu::Device& device, const capture::ColorCamera& camera, const capture::DepthNoise& depth_noise)
    : device_(device),
      camera_(camera),
      model_(camera.model),
      pixel_rays_(camera.model),
      depth_noise_(depth_noise),
      object_view_(device),
      real_view_(device),
      real_change_(device),
      layers_(device),
      live_view_(device),
      still_(camera.model) {}

void CameraView::fit(const Plan& plan, int max_lamps, bool glossy) {
  const Quality quality = quality_of(plan);
  // Highlights on glossy surfaces are sharp: not traced at reduced resolution.
  const int shadow_scale = glossy ? 1 : quality.shadow_scale;
  if (screen_ && screen_->scale == plan.trace_scale && screen_->shadow_scale == shadow_scale &&
      screen_->ambient_scale == quality.ambient_scale && screen_->supersampling == quality.supersampling &&
      screen_->max_lamps == max_lamps)
    return;
  screen_ = std::make_unique<Screen>(device_, model_.width, model_.height, plan.trace_scale, shadow_scale,
                                     quality.ambient_scale, quality.supersampling, max_lamps);
  camera_.upload_rays(device_, *screen_);
  shown_ = Shown::nothing;
}

void CameraView::show_live(const capture::FrameSet& frame, const View& view, const Light& light,
                           const LampShadows& shadows, RelitPicture* result) {
  const bool anew = view.anew || view.with_maps || shown_ != Shown::live;
  const std::vector<char> changed =
      still_.changed_tiles(*camera_.coded(), depth_of(frame, model_), 2 * view.params.field.x(), anew);
  if (std::find(changed.begin(), changed.end(), 1) != changed.end()) {
    camera_.upload(device_, frame, view.with_maps || !view.glossy.empty(), *screen_);
    screen_->tiles->choose(device_, view.params, {camera_.rays(), depth_of(frame, model_), *camera_.coded()},
                           view.objects,
                           {quality_of(view.plan).min_code_change, view.glossy, &shadows, view.with_maps, &changed});
    auto list = device_.begin();
    if (view.with_maps) draw_full(*list, view, light);
    draw_live(*list, view, light, shadows, anew);
    submit(*list, result);
    live_picture_.read(device_, *screen_, camera_, changed);
  }
  const CurrentDepth depth(pixel_rays_, depth_of(frame, model_), view.params.field.x(), depth_noise_);
  result->srgb = live_picture_.over(camera_, depth, view.motion, blur_px());
  give_look(frame, live_picture_.shown(), &result->srgb);
  shown_ = Shown::live;
  if (view.with_maps) add_maps(depth, live_picture_.objects(), result);
}

void CameraView::show_full(const capture::FrameSet& frame, const View& view, const Light& light, gpu::CommandList& list,
                           RelitPicture* result) {
  bool anew = view.anew || view.with_maps || shown_ != Shown::full;
  const float min_change_m = 2 * view.params.field.x();
  const std::vector<char> changed = still_.changed_tiles(*camera_.coded(), depth_of(frame, model_), min_change_m, anew);
  if (!anew && std::find(changed.begin(), changed.end(), 1) != changed.end()) {
    anew = true;
    still_.changed_tiles(*camera_.coded(), depth_of(frame, model_), min_change_m, true);
  }
  const bool drawn =
      anew || !same_codes() || (full_exposure_ != camera_.exposure()).any() || full_vignetting_ != camera_.vignetting();
  if (drawn) {
    camera_.upload(device_, frame, true, *screen_);
    if (anew) {
      screen_->tiles->choose(device_, view.params, {camera_.rays(), depth_of(frame, model_), *camera_.coded()},
                             view.objects,
                             {quality_of(view.plan).min_code_change, view.glossy, nullptr, view.with_maps, nullptr});
      draw_full(list, view, light);
    } else {
      list.begin_pass("layers");
      layers_.record(list, view.params, *screen_);
    }
    submit(list, result);
    full_codes_ = camera_.coded();
    full_exposure_ = camera_.exposure();
    full_vignetting_ = camera_.vignetting();
    read_layers();
  }
  const CurrentDepth depth(pixel_rays_, depth_of(frame, model_), view.params.field.x(), depth_noise_);
  if (drawn || full_blur_px_ != blur_px() || full_moving_ != view.motion.any()) {
    full_blur_px_ = blur_px();
    full_moving_ = view.motion.any();
    full_soft_ = full_moving_ ? softened(view.motion.of(full_objects_), full_blur_px_, model_.width, model_.height)
                              : softened(full_objects_, full_blur_px_, model_.width, model_.height);
    full_picture_ = {};
  }
  const std::optional<ObjectLayer> hidden = behind_foreground(depth, camera_, full_soft_);
  const ObjectLayer& shown = hidden ? *hidden : full_soft_;
  if (full_picture_.empty() || hidden || full_foreground_) {
    full_picture_ = *camera_.coded();
    compose(camera_, {full_change_, full_radiance_.empty() ? nullptr : &full_radiance_}, shown, &full_picture_);
    full_foreground_ = hidden.has_value();
  }
  result->srgb = full_picture_;
  give_look(frame, shown, &result->srgb);
  shown_ = Shown::full;
  if (view.with_maps) add_maps(depth, full_objects_, result);
}

/// Of the blocks that were drawn; nothing changes in the others.
void CameraView::read_layers() {
  full_change_ = capture::Image<float>(screen_->width, screen_->height, 3);
  full_objects_ = {};
  const std::vector<std::uint32_t>& places = screen_->tiles->view_places();
  const std::array<WantedTiles, 2> objects = object_tiles(*screen_, places);
  std::vector<WantedTiles> wanted{objects[0], objects[1], {*screen_->delta, places}};
  if (camera_.any_clipped()) wanted.push_back({*screen_->room_radiance, places});
  const TileReader reader(device_, wanted);
  read_objects(reader, 0, *screen_, camera_.rays(), places, &full_objects_);
  reader.read(2, 0, 3, &full_change_.data);
  full_radiance_ = {};
  if (camera_.any_clipped()) {
    full_radiance_ = capture::Image<float>(screen_->width, screen_->height, 3);
    reader.read(3, 0, 3, &full_radiance_.data);
  }
}

void CameraView::take(const capture::FrameSet& frame, const reconstruct::Scene& scene, bool like_camera) {
  camera_.take(frame);
  like_camera_ = like_camera;
  if (like_camera) look_.follow(camera_.coded(), model_, scene.pose, depth_of(frame, model_));
}

void CameraView::give_look(const capture::FrameSet& frame, const ObjectLayer& objects,
                           capture::Image<std::uint8_t>* picture) const {
  if (!like_camera_) return;
  if (frame.color->original) subsample_chroma(capture::chroma_block(*frame.color->original), objects, picture);
  if (look_.noise()) add_noise(*look_.noise(), *camera_.coded(), objects, frame.index, picture);
}

/// As those of the picture that the screen holds.
bool CameraView::same_codes() const {
  return full_codes_ && (full_codes_ == camera_.coded() || full_codes_->data == camera_.coded()->data);
}

void CameraView::draw_full(gpu::CommandList& list, const View& view, const Light& light) const {
  const Quality quality = quality_of(view.plan);
  const shader::FrameParams& params = view.params;
  const Volumes& volumes = light.rounds.room().volumes;
  const Lpv* lpv = light.rounds.passes().lpv();
  const bool glossy = !view.known_surfaces.empty();
  // Passes write selected blocks only; the others must not show results of the last frame.
  for (const auto* stale :
       {&screen_->real_position, &screen_->real_normal, &screen_->object_surface, &screen_->shadowed,
        &screen_->direct_lost, &screen_->traced, &screen_->indirect, &screen_->object_irradiance}) {
    list.clear(**stale, {});
  }
  list.begin_pass("views");
  object_view_.draw(list, params, view.objects, quality.simple_models, view.white, *screen_);
  if (glossy) object_view_.draw_known(list, params, view.known_surfaces, view.white, *screen_);
  list.begin_pass("real view");
  if (quality.cells) {
    real_view_.from_volumes(list, params, quality.min_code_change, volumes, *screen_);
  } else {
    real_view_.from_bricks(list, params, quality.min_code_change, light.bricks, *screen_);
  }
  list.begin_pass("object view");
  object_view_.resolve(list, params, *screen_);
  list.begin_pass("shadow");
  real_change_.shadow(list, params, glossy, glossy && !view.live, light.maps, volumes, *screen_);
  if (screen_->shadow_scale > 1)
    real_change_.upsample(list, params, *screen_, screen_->tiles->shaded(), *screen_->shadowed, *screen_->direct_lost,
                          screen_->shadow_scale, 1);
  if (!quality.cells && lpv) {
    list.begin_pass("look up");
    lpv->look_up(list, params, volumes, *screen_);
  } else if (!quality.cells) {
    list.begin_pass("trace");
    real_change_.trace(list, params, quality.change_cones, volumes, *screen_);
    list.begin_pass("upsample");
    real_change_.upsample(list, params, *screen_, screen_->tiles->changed(), *screen_->traced, *screen_->indirect,
                          view.plan.trace_scale, quality.window);
  }
  if (glossy) {
    list.begin_pass("reflect");
    real_change_.reflect(list, params, volumes, *screen_);
  }
  light_objects(list, params, light);
  list.begin_pass("layers");
  layers_.record(list, params, *screen_);
}

/// `objects_anew`: false if the objects' radiance is unchanged.
void CameraView::draw_live(gpu::CommandList& list, const View& view, const Light& light, const LampShadows& shadows,
                           bool objects_anew) const {
  const AmortizedLightUpdate& rounds = light.rounds;
  const bool matt = ObjectLight::enough_for(view.objects), glossy = !view.known_surfaces.empty();
  const Volumes& volumes = rounds.room().volumes;
  list.begin_pass("views");
  if (glossy) {
    // Blocks without objects are not drawn here but are read.
    list.clear(*screen_->object_surface, {});
    list.clear(*screen_->object_layer, {});
    list.clear(*screen_->object_z, {});
    if (objects_anew) object_view_.draw_known(list, view.params, view.known_surfaces, view.white, *screen_);
  }
  if (objects_anew && matt)
    live_view_.draw_objects(list, view.params, view.objects, rounds.passes().object_light(), view.white, *screen_);
  if (objects_anew && !matt)
    object_view_.draw(list, view.params, view.objects, quality_of(view.plan).simple_models, view.white, *screen_);
  if (!matt) {
    list.begin_pass("object view");
    live_view_.place(list, view.params, volumes, *screen_);
    object_view_.resolve(list, view.params, *screen_);
    light_objects(list, view.params, light);
  }
  list.begin_pass("compose");
  live_view_.compose(list, view.params, shadows, light.maps, matt, volumes, rounds.irradiance(), *screen_);
  if (glossy) {
    list.begin_pass("reflect");
    live_view_.see_gloss(list, view.params, shadows, light.maps, volumes, rounds.irradiance(), *screen_);
    real_change_.reflect(list, view.params, volumes, *screen_);
    live_view_.add_gloss(list, view.params, *screen_);
  }
}

void CameraView::light_objects(gpu::CommandList& list, const shader::FrameParams& params, const Light& light) const {
  list.begin_pass("ambient");
  object_view_.ambient(list, params, light.rounds.room().volumes, *screen_);
  list.begin_pass("shade");
  object_view_.shade(list, params, light.maps, light.rounds.room().volumes, *screen_);
}

void CameraView::submit(gpu::CommandList& list, RelitPicture* result) {
  const std::vector<gpu::PassTime> passes = device_.submit(list);
  result->passes.insert(result->passes.end(), passes.begin(), passes.end());
}

void CameraView::add_maps(const CurrentDepth& depth, const ObjectLayer& objects, RelitPicture* result) {
  const std::optional<ObjectLayer> hidden = behind_foreground(depth, camera_, objects);
  result->maps = read_maps(device_, *screen_, (hidden ? *hidden : objects).coverage);
  shown_ = Shown::nothing;  // every block was drawn per pixel
}

}  // namespace lumigraft::relight
