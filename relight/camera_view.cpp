#include "relight/camera_view.h"

#include <algorithm>

#include "relight/read_back.h"

namespace lumigraft::relight {

CameraView::CameraView(gpu::Device& device, const capture::ColorCamera& camera)
    : device_(device),
      camera_(camera),
      model_(camera.model),
      object_view_(device),
      real_view_(device),
      shadow_(device),
      trace_(device),
      reflect_(device),
      object_shading_(device),
      compose_(device),
      live_view_(device),
      still_(camera.model) {}

void CameraView::fit(const Plan& plan, bool glossy) {
  const Quality quality = quality_of(plan);
  // Highlights on glossy surfaces are sharp: not traced at reduced resolution.
  const int shadow_scale = glossy ? 1 : quality.shadow_scale;
  if (screen_ && screen_->scale == plan.trace_scale && screen_->shadow_scale == shadow_scale &&
      screen_->ambient_scale == quality.ambient_scale && screen_->supersampling == quality.supersampling)
    return;
  screen_ = std::make_unique<Screen>(device_, model_.width, model_.height, plan.trace_scale, shadow_scale,
                                     quality.ambient_scale, quality.supersampling);
  camera_.upload_rays(device_, *screen_);
  shown_ = Shown::nothing;
}

void CameraView::show_live(const capture::FrameSet& frame, const View& view, const Light& light,
                           const LampShadows& shadows, RelitPicture* result) {
  const bool anew = view.anew || view.with_maps || shown_ != Shown::live;
  const std::vector<char> changed =
      still_.changed_tiles(*camera_.coded(), depth_of(frame), 2 * view.params.field.x(), anew);
  if (std::find(changed.begin(), changed.end(), 1) != changed.end()) {
    camera_.upload(device_, frame, view.with_maps || !view.glossy.empty(), *screen_);
    screen_->tiles->choose(device_, view.params, {camera_.rays(), depth_of(frame), *camera_.coded()}, view.objects,
                           {quality_of(view.plan).min_code_change, view.glossy, &shadows, view.with_maps, &changed});
    auto list = device_.begin();
    if (view.with_maps) draw_full(*list, view, light);
    draw_live(*list, view, light, shadows, anew);
    submit(*list, result);
    live_picture_.read(device_, *screen_, changed);
  }
  result->srgb = live_picture_.over(camera_);
  shown_ = Shown::live;
  if (view.with_maps) read_maps(result);
}

void CameraView::show_full(const capture::FrameSet& frame, const View& view, const Light& light, gpu::CommandList& list,
                           RelitPicture* result) {
  bool anew = view.anew || view.with_maps || shown_ != Shown::full;
  const float min_change_m = 2 * view.params.field.x();
  const std::vector<char> changed = still_.changed_tiles(*camera_.coded(), depth_of(frame), min_change_m, anew);
  if (!anew && std::find(changed.begin(), changed.end(), 1) != changed.end()) {
    anew = true;
    still_.changed_tiles(*camera_.coded(), depth_of(frame), min_change_m, true);
  }
  if (anew || !same_codes() || (full_exposure_ != camera_.exposure()).any() ||
      full_vignetting_ != camera_.vignetting()) {
    camera_.upload(device_, frame, true, *screen_);
    if (anew) {
      screen_->tiles->choose(device_, view.params, {camera_.rays(), depth_of(frame), *camera_.coded()}, view.objects,
                             {quality_of(view.plan).min_code_change, view.glossy, nullptr, view.with_maps, nullptr});
      draw_full(list, view, light);
    } else {
      list.begin_pass("compose");
      compose_.record(list, view.params, *screen_);
    }
    submit(list, result);
    full_codes_ = camera_.coded();
    full_exposure_ = camera_.exposure();
    full_vignetting_ = camera_.vignetting();
    full_drawn_ = device_.download(*screen_->picture);
  }
  result->srgb = with_drawn_blocks(*camera_.coded(), full_drawn_, *screen_);
  shown_ = Shown::full;
  if (view.with_maps) read_maps(result);
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
  shadow_.record(list, params, glossy, glossy && !view.live, light.maps, volumes, *screen_);
  if (screen_->shadow_scale > 1)
    trace_.upsample(list, params, *screen_, screen_->tiles->shaded(), *screen_->shadowed, *screen_->direct_lost,
                    screen_->shadow_scale, 1);
  if (!quality.cells && lpv) {
    list.begin_pass("look up");
    lpv->look_up(list, params, volumes, *screen_);
  } else if (!quality.cells) {
    list.begin_pass("trace");
    trace_.trace(list, params, quality.change_cones, volumes, *screen_);
    list.begin_pass("upsample");
    trace_.upsample(list, params, *screen_, screen_->tiles->changed(), *screen_->traced, *screen_->indirect,
                    view.plan.trace_scale, quality.window);
  }
  if (glossy) {
    list.begin_pass("reflect");
    reflect_.record(list, params, volumes, *screen_);
  }
  light_objects(list, params, light);
  list.begin_pass("compose");
  compose_.record(list, params, *screen_);
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
    list.clear(*screen_->live_object, {});
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
  live_view_.compose(list, view.params, shadows, matt, volumes, rounds.irradiance(), *screen_);
  if (glossy) {
    list.begin_pass("reflect");
    live_view_.see_gloss(list, view.params, shadows, light.maps, volumes, rounds.irradiance(), *screen_);
    reflect_.record(list, view.params, volumes, *screen_);
    live_view_.add_gloss(list, view.params, *screen_);
  }
}

void CameraView::light_objects(gpu::CommandList& list, const shader::FrameParams& params, const Light& light) const {
  list.begin_pass("ambient");
  object_shading_.ambient(list, params, light.rounds.room().volumes, *screen_);
  list.begin_pass("shade");
  object_shading_.shade(list, params, light.maps, light.rounds.room().volumes, *screen_);
}

const capture::Image<float>* CameraView::depth_of(const capture::FrameSet& frame) const {
  return frame.depth && frame.depth->depth_m.data.size() * 2 == camera_.rays().size() ? &frame.depth->depth_m : nullptr;
}

void CameraView::submit(gpu::CommandList& list, RelitPicture* result) {
  const std::vector<gpu::PassTime> passes = device_.submit(list);
  result->passes.insert(result->passes.end(), passes.begin(), passes.end());
}

void CameraView::read_maps(RelitPicture* result) {
  result->maps = lumigraft::relight::read_maps(device_, *screen_);
  shown_ = Shown::nothing;  // every block was drawn per pixel
}

}  // namespace lumigraft::relight
