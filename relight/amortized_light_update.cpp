#include "relight/amortized_light_update.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>

#include "relight/quality.h"
#include "relight/upload/parameters.h"

namespace lumigraft::relight {
namespace {

bool near(const PlacedObject& a, const PlacedObject& b) {
  if (a.stored->model != b.stored->model) return false;
  PlacedObject moved = a;
  moved.stored = b.stored;
  moved.T_tag_model = b.T_tag_model;
  if (!(moved == b)) return false;
  const Eigen::Matrix3f turn = a.T_tag_model.linear().inverse() * b.T_tag_model.linear();
  const float scale = std::cbrt(turn.determinant());
  const float cosine = 0.5f * (turn.trace() / scale - 1);
  return std::abs(scale - 1) < kRelight.max_scale && cosine > std::cos(kRelight.max_turn_rad) &&
         (a.bounds.sphere.centre_m - b.bounds.sphere.centre_m).norm() < kRelight.max_move * a.bounds.sphere.radius_m;
}

bool near(float a, float b) { return std::abs(a - b) <= kRelight.max_light * std::max(std::abs(a), std::abs(b)); }

bool near(const reconstruct::Illumination& a, const reconstruct::Illumination& b) {
  if (&a == &b) return true;
  if (a.lights.size() != b.lights.size()) return false;
  for (std::size_t i = 0; i < a.lights.size(); ++i) {
    const reconstruct::PointLight &p = a.lights[i], &q = b.lights[i];
    if (p.id != q.id || p.distance_known != q.distance_known || p.flat != q.flat) return false;
    if (!near(p.irradiance.maxCoeff(), q.irradiance.maxCoeff())) return false;
    if (p.distance_known && !near(p.intensity.maxCoeff(), q.intensity.maxCoeff())) return false;
    if ((p.direction - q.direction).norm() > kRelight.max_lamp_move) return false;
    if (p.distance_known &&
        (p.position_m - q.position_m).norm() > kRelight.max_lamp_move * (p.position_m - a.probe_position_m).norm())
      return false;
  }
  return near(a.environment_sh[0].maxCoeff(), b.environment_sh[0].maxCoeff());
}

bool near_room(const LightKey& a, const LightKey& b) {
  return near(*a.illumination, *b.illumination) &&
         ((a.field == b.field && a.enclosure == b.enclosure) || b.field->version >= kRelight.young_field);
}

bool near(const std::vector<PlacedObject>& a, const std::vector<PlacedObject>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](const PlacedObject& p, const PlacedObject& q) { return near(p, q); });
}

/// For each object, the buffer in `from` of the same model that is nearest, null if there is none. Each is used once.
std::vector<const gpu::Buffer*> buffers_of(const std::vector<PlacedObject>& objects, const ObjectsLight& from) {
  std::vector<const gpu::Buffer*> found(objects.size(), nullptr);
  std::vector<char> taken(from.objects.size(), 0);
  for (std::size_t i = 0; i < objects.size(); ++i) {
    std::size_t nearest = from.objects.size();
    float nearest_m = std::numeric_limits<float>::infinity();
    for (std::size_t j = 0; j < from.objects.size(); ++j) {
      if (taken[j] || from.objects[j].stored->model != objects[i].stored->model) continue;
      const float far_m = (from.objects[j].bounds.sphere.centre_m - objects[i].bounds.sphere.centre_m).norm();
      if (far_m >= nearest_m) continue;
      nearest = j;
      nearest_m = far_m;
    }
    if (nearest == from.objects.size()) continue;
    taken[nearest] = 1;
    found[i] = from.light[nearest].get();
  }
  return found;
}

void upload_environment(gpu::Device& device, const LightSet& lights, const Volumes& volumes) {
  for (int mip = 0; mip < kUpload.environment_mips; ++mip) {
    const capture::Image<float>& level = lights.environment[static_cast<std::size_t>(mip)];
    std::vector<Eigen::half> halves(level.data.size());
    std::transform(level.data.begin(), level.data.end(), halves.begin(),
                   [](float x) { return Eigen::half(std::min(x, 65504.0f)); });
    device.upload(*volumes.environment, mip, std::as_bytes(std::span(halves)));
  }
}

}  // namespace

AmortizedLightUpdate::AmortizedLightUpdate(gpu::Device& device)
    : device_(device), light_(device), mix_(device.create_compute("irradiance_mix.comp")) {}

void AmortizedLightUpdate::fit(const Plan& plan, const gpu::Texture& mirror_outlines, const gpu::Buffer& gone_cells) {
  if (!shown_ || shown_->volumes.edge != plan.volume) {
    shown_.reset();  // device memory may not suffice for two
    next_.reset();
    running_ = fading_ = false;
    last_.reset();
    auto room = std::make_unique<LightVolumeState>(device_, plan.volume);
    room->volumes.fit_cells(device_, smooths_cells(plan));
    room->volumes.mirror_outlines = &mirror_outlines;
    room->volumes.gone_cells = &gone_cells;
    shown_ = std::move(room);
    older_irradiance_.reset();
    mixed_irradiance_.reset();
    why_no_rounds_.clear();
  }
  for (LightVolumeState* room : {shown_.get(), next_.get()}) {
    if (room) room->volumes.fit_cells(device_, smooths_cells(plan));
  }
  light_.fit(plan);
}

const gpu::Texture& AmortizedLightUpdate::irradiance() const {
  return fading_ ? *mixed_irradiance_ : *shown_->volumes.real_irradiance;
}

AmortizedLightUpdate::Done AmortizedLightUpdate::advance(gpu::CommandList& list, const Now& now, BrickPool& bricks) {
  const bool lit = shown_->lit.has_value(), same_room = last_ && near_room(*last_, now.key);
  const bool same_set =
      last_ && LightKey::same_light(last_->plan, now.key.plan) && same_models(last_->objects, now.key.objects);
  const bool same_places = same_set && near(last_->objects, now.key.objects);
  const bool follows = now.incremental && lit && same_room && same_places;
  bool jumps = false, goes_on = follows;
  if (now.budget_ms && !follows && !lit) {
    jumps = !running_ || !same_set;
    goes_on = !jumps;
  } else if (now.budget_ms && !follows && same_room) {
    // Objects whose light may not lag are deferred only where they appear or disappear.
    jumps = !same_set || (now.incremental && !same_places);
    goes_on = jumped_ && (running_ || fading_) && last_->objects == now.key.objects;
  }
  Done done;
  if (!why_no_rounds_.empty() || !(jumps || goes_on)) {
    done = all_at_once(list, now, bricks);
  } else {
    try {
      if (!jumps) go_on(list, now, &done);
      const bool due = follows && !running_ && frame_ % kRelight.round_frames == 0 && !(*shown_->lit == now.key);
      if ((jumps || due) && !begin_round(list, now, bricks, jumps)) done = all_at_once(list, now, bricks);
    } catch (const gpu::DeviceLost&) {
      throw;
    } catch (const gpu::GpuError& e) {
      next_.reset();
      older_irradiance_.reset();
      mixed_irradiance_.reset();
      why_no_rounds_ = e.what();
      done = all_at_once(list, now, bricks);
    }
  }
  last_ = now.key;
  find_vertex_light(list, now, &done);
  if (fading_) fade(list, shown_->params);
  return done;
}

/// The next part of the round and of the fade.
void AmortizedLightUpdate::go_on(gpu::CommandList& list, const Now& now, Done* done) {
  if (!running_ && !fading_) return;
  ++frame_;
  done->changed = fading_;
  done->recorded = fading_ || (running_ && !jumped_);
  if (running_ && jumped_) {
    run_part(*now.budget_ms, done);
    if (frame_ > kRelight.round_frames) fading_ = false;
  } else if (running_) {
    record_part(list);
  }
  if (running_ ? done_ == steps_.size() && (jumped_ || frame_ >= kRelight.round_frames)
               : frame_ >= kRelight.round_frames)
    end_round();
}

/// False if device memory does not suffice.
bool AmortizedLightUpdate::begin_round(gpu::CommandList& list, const Now& now, BrickPool& bricks, bool jump) {
  if (!next_ && !make_next(list, now)) return false;
  if (!fading_) frame_ = 0;
  running_ = true;
  jumped_ = jump;
  done_ = 0;
  next_key_ = now.key;
  steps_ = begin(now, jump ? kRelight.jump_slices : kRelight.slices, bricks, *next_);
  return true;
}

bool AmortizedLightUpdate::reaches(const std::vector<PlacedObject>& objects) const {
  if (!shown_->lit) return false;
  const shader::vec4& outer = shown_->params.cascade[shader::kCascades - 1];
  const float edge_m = outer.w() * static_cast<float>(shown_->volumes.edge);
  const Eigen::Vector3f low = outer.head<3>();
  const Eigen::AlignedBox3f box(low, low + Eigen::Vector3f::Constant(edge_m));
  return std::any_of(objects.begin(), objects.end(),
                     [&](const PlacedObject& object) { return box.contains(object.bounds.sphere.centre_m); });
}

/// Fills older_ and newer_.
void AmortizedLightUpdate::find_vertex_light(gpu::CommandList& list, const Now& now, Done* done) {
  const std::vector<PlacedObject>& objects = now.key.objects;
  older_.clear();
  newer_.clear();
  if (!now.live || !shown_->lit || !ObjectLight::enough_for(objects)) return;
  newer_ = buffers_of(objects, shown_->gathered);
  older_ = fading_ ? buffers_of(objects, older_gathered_) : newer_;
  std::vector<PlacedObject> missing;
  for (std::size_t i = 0; i < objects.size(); ++i) {
    if (!newer_[i] || !older_[i]) missing.push_back(objects[i]);
  }
  ObjectLight::fit(device_, missing, &ungathered_.light);
  for (std::size_t i = 0, used = 0; i < objects.size(); ++i) {
    if (newer_[i] && older_[i]) continue;
    const gpu::Buffer& buffer = *ungathered_.light[used++];
    if (missing != ungathered_.objects) {
      list.begin_pass("object light");
      light_.object_light().unoccluded(list, now.params, objects[i], buffer);
      done->recorded = true;
    }
    if (!newer_[i]) newer_[i] = &buffer;
    if (!older_[i]) older_[i] = &buffer;
  }
  ungathered_.objects = std::move(missing);
}

/// Allocates what is needed in addition to the displayed volumes; false if device memory does not suffice.
bool AmortizedLightUpdate::make_next(gpu::CommandList& list, const Now& now) {
  try {
    const gpu::TextureDesc irradiance = shown_->volumes.real_irradiance->desc();
    older_irradiance_ = device_.create_texture(irradiance);
    mixed_irradiance_ = device_.create_texture(irradiance);
    next_ = std::make_unique<LightVolumeState>(device_, shown_->volumes.edge);
    next_->volumes.fit_cells(device_, shown_->volumes.rough_irradiance != nullptr);
  } catch (const gpu::DeviceLost&) {
    throw;
  } catch (const gpu::GpuError& e) {
    older_irradiance_.reset();
    mixed_irradiance_.reset();
    why_no_rounds_ = e.what();
    return false;
  }
  next_->volumes.mirror_outlines = shown_->volumes.mirror_outlines;
  next_->volumes.gone_cells = shown_->volumes.gone_cells;
  if (!shown_->lit) {  // the first round is faded in, too
    shown_->params = now.params;
    list.clear(*shown_->volumes.real_irradiance, {});
  }
  return true;
}

AmortizedLightUpdate::Done AmortizedLightUpdate::all_at_once(gpu::CommandList& list, const Now& now,
                                                             BrickPool& bricks) {
  const bool under_way = running_ || fading_;
  running_ = fading_ = false;
  frame_ = 0;
  if (shown_->lit && *shown_->lit == now.key) return {false, under_way};
  Done done{true, true};
  const std::vector<LightStep> steps = begin(now, 1, bricks, *shown_);
  const auto on_host = [](const LightStep& step) { return step.on_host != nullptr; };
  auto step = steps.begin();
  for (auto wait = std::find_if(step, steps.end(), on_host); wait != steps.end();
       wait = std::find_if(step, steps.end(), on_host)) {
    const auto before = device_.begin();
    for (; step != wait; ++step) {
      before->begin_pass(step->pass);
      step->record(*before);
    }
    const std::vector<gpu::PassTime> passes = device_.submit(*before);
    done.passes.insert(done.passes.end(), passes.begin(), passes.end());
    step++->on_host();
  }
  for (; step != steps.end(); ++step) {
    list.begin_pass(step->pass);
    step->record(list);
  }
  shown_->real = now.key.real();
  shown_->lit = now.key;
  return done;
}

/// Updates the CPU-side data for lamps and room, and returns the steps that remain to be recorded.
std::vector<LightStep> AmortizedLightUpdate::begin(const Now& now, int slices, BrickPool& bricks,
                                                   LightVolumeState& room) {
  const Placement& placement = now.key.placement;
  // Bricks in the reach of cones, plus half that extent for the pixels that cones start from.
  const float edge = static_cast<float>(now.key.plan.volume) * placement.cascade[1].w();
  const Eigen::Vector3f reach = Eigen::Vector3f::Constant(0.75f * edge);
  bricks.update(now.key.field, now.key.albedo, {placement.sphere.centre_m - reach, placement.sphere.centre_m + reach});
  room.volumes.fit_virtual(device_, placement.virtual_size);
  upload_environment(device_, now.lights, room.volumes);
  room.params = now.params;
  bricks.describe(room.params);
  std::vector<LightStep> steps =
      light_.steps({room.params, now.key, now.live, &now.maps, now.brightest, slices}, bricks, now.white, room);
  room.lit.reset();  // until all steps are done
  if (room.real && !(*room.real == now.key.real())) room.real.reset();
  return steps;
}

void AmortizedLightUpdate::record_part(gpu::CommandList& list) {
  float all = 0, before = 0;
  for (const LightStep& step : steps_) all += step.cost;
  for (std::size_t i = 0; i < done_; ++i) before += steps_[i].cost;
  const float until = all * static_cast<float>(frame_) / kRelight.round_frames;
  bool recorded = false;
  while (done_ < steps_.size() && (before < until || frame_ >= kRelight.round_frames)) {
    const LightStep& step = steps_[done_];
    if (step.on_host) {
      if (recorded) return;  // the results it needs are computed by this frame's list
      step.on_host();
    } else {
      list.begin_pass(step.pass);
      step.record(list);
      recorded = true;
    }
    before += step.cost;
    ++done_;
  }
}

/// As many steps as the budget allows, at least one if there is a budget.
void AmortizedLightUpdate::run_part(double budget_ms, Done* done) {
  if (budget_ms <= 0) return;
  const auto begin = std::chrono::steady_clock::now();
  const auto elapsed_ms = [&] {
    return std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - begin).count();
  };
  double before_ms = 0;
  do {
    const LightStep& step = steps_[done_++];
    if (step.on_host) {
      step.on_host();
    } else {
      const auto list = device_.begin();
      list->begin_pass(step.pass);
      step.record(*list);
      const std::vector<gpu::PassTime> passes = device_.submit(*list);
      done->passes.insert(done->passes.end(), passes.begin(), passes.end());
    }
    const double after_ms = elapsed_ms();
    if (step.cost > 0)
      ms_per_cost_ = std::lerp(ms_per_cost_, static_cast<float>(after_ms - before_ms) / step.cost, 0.2f);
    before_ms = after_ms;
  } while (done_ < steps_.size() && before_ms + ms_per_cost_ * steps_[done_].cost < budget_ms);
}

void AmortizedLightUpdate::end_round() {
  frame_ = 0;
  fading_ = running_;
  if (!running_) return;
  running_ = false;
  steps_.clear();
  next_->real = next_key_.real();
  next_->lit = next_key_;
  std::copy_n(shown_->params.cascade, shader::kCascades, older_cascade_);
  std::swap(shown_, next_);
  std::swap(older_gathered_, next_->gathered);
  std::swap(older_irradiance_, next_->volumes.real_irradiance);
}

void AmortizedLightUpdate::fade(gpu::CommandList& list, const shader::FrameParams& lit_params) const {
  shader::FrameParams params = lit_params;
  params.pass_f = older_cascade_[0];
  params.pass_g = older_cascade_[1];
  params.pass_m(0, 0) = newer_weight();
  list.begin_pass("fade");
  dispatch_cascades(list, *mix_,
                    {gpu::sampled(1, *older_irradiance_, gpu::Filter::linear),
                     gpu::image(2, *shown_->volumes.real_irradiance), gpu::image(3, *mixed_irradiance_)},
                    params, shown_->volumes.edge / 2);
}

}  // namespace lumigraft::relight
