#include "relight/amortized_light_update.h"

#include <algorithm>
#include <cmath>

#include "relight/quality.h"
#include "relight/upload/parameters.h"

namespace lumigraft::relight {
namespace {

bool near(const PlacedObject& a, const PlacedObject& b) {
  if (a.stored != b.stored) return false;
  PlacedObject moved = a;
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

bool near(const LightKey& a, const LightKey& b) {
  return LightKey::same_light(a.plan, b.plan) && near(*a.illumination, *b.illumination) &&
         ((a.field == b.field && a.enclosure == b.enclosure) || b.field->version >= kRelight.young_field) &&
         std::equal(a.objects.begin(), a.objects.end(), b.objects.begin(), b.objects.end(),
                    [](const PlacedObject& p, const PlacedObject& q) { return near(p, q); });
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

void AmortizedLightUpdate::fit(const Plan& plan, const gpu::Texture& mirror_outlines) {
  if (!shown_ || shown_->volumes.edge != plan.volume) {
    shown_.reset();  // device memory may not suffice for two
    next_.reset();
    running_ = fading_ = false;
    last_.reset();
    auto room = std::make_unique<LightVolumeState>(device_, plan.volume);
    room->volumes.fit_cells(device_, smooths_cells(plan));
    room->volumes.mirror_outlines = &mirror_outlines;
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
  const bool in_rounds = now.incremental && shown_->lit && last_ && near(*last_, now.key) && why_no_rounds_.empty();
  if (!in_rounds) return all_at_once(list, now, bricks);
  last_ = now.key;
  Done done;
  if (running_ || fading_) {
    ++frame_;
    done.changed = fading_;
    if (running_) {
      try {
        record_part(list);
      } catch (const gpu::DeviceLost&) {
        throw;
      } catch (const gpu::GpuError& e) {
        next_.reset();
        older_irradiance_.reset();
        mixed_irradiance_.reset();
        why_no_rounds_ = e.what();
        return all_at_once(list, now, bricks);
      }
    }
    done.recorded = running_ || fading_;
    if (frame_ >= kRelight.round_frames && (!running_ || done_ == steps_.size())) end_round();
  }
  if (!running_ && frame_ % kRelight.round_frames == 0 && !(*shown_->lit == now.key)) {
    if (!next_ && !make_next()) return all_at_once(list, now, bricks);
    frame_ = 0;
    running_ = true;
    done_ = 0;
    next_key_ = now.key;
    steps_ = begin(now, kRelight.slices, bricks, *next_);
  }
  if (fading_) fade(list, shown_->params);
  return done;
}

/// Allocates what is needed in addition to the displayed volumes; false if device memory does not suffice.
bool AmortizedLightUpdate::make_next() {
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
  return true;
}

AmortizedLightUpdate::Done AmortizedLightUpdate::all_at_once(gpu::CommandList& list, const Now& now,
                                                             BrickPool& bricks) {
  const bool under_way = running_ || fading_;
  running_ = fading_ = false;
  frame_ = 0;
  last_ = now.key;
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
