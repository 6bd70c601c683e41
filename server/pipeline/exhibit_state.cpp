#include "server/pipeline/exhibit_state.h"

#include <algorithm>
#include <array>
#include <nlohmann/json.hpp>
#include <numbers>
#include <utility>

#include "capture/text_file.h"
#include "server/pipeline/json_text.h"
#include "server/pipeline/saved_exhibit.h"

namespace lumigraft::server {
namespace {

using Json = nlohmann::ordered_json;

relight::MaterialOverride changed(relight::MaterialOverride material, const MaterialChange& change) {
  if (change.models_own) return {};
  material.base_color = change.base_color.value_or(material.base_color);
  material.metallic = change.metallic.value_or(material.metallic);
  material.roughness = change.roughness.value_or(material.roughness);
  material.specular = change.specular.value_or(material.specular);
  material.emission = change.emission.value_or(material.emission);
  material.transmission = change.transmission.value_or(material.transmission);
  material.ior = change.ior.value_or(material.ior);
  material.thin_walled = change.thin_walled.value_or(material.thin_walled);
  material.attenuation_color = change.attenuation_color.value_or(material.attenuation_color);
  material.attenuation_distance_m = change.attenuation_distance_m.value_or(material.attenuation_distance_m);
  material.clearcoat = change.clearcoat.value_or(material.clearcoat);
  material.clearcoat_roughness = change.clearcoat_roughness.value_or(material.clearcoat_roughness);
  return material;
}

/// The animation after a change by a viewer who saw the frame at `time_s`. Returns the error, if any.
std::optional<std::string> change_animation(const AnimationChange& change, double time_s,
                                            relight::VirtualObject& object) {
  if (!object.animation) return "animation: the object's model has none, see hello";
  relight::ShownAnimation now = *object.animation;
  const std::vector<relight::Rig::Animation>& all = object.model->rig->animations;
  if (change.name) {
    const auto found = std::ranges::find(all, *change.name, &relight::Rig::Animation::name);
    if (found == all.end()) return "animation: no animation of the object has this name, see hello";
    now.index = static_cast<std::size_t>(found - all.begin());
  }
  const double length_s = all[now.index].length_s;
  const bool other = now.index != object.animation->index, playing = change.playing.value_or(!now.held_s);
  double at_s = change.at_s.value_or(other ? 0 : now.moment_s(length_s, time_s));
  now.loops = change.loop.value_or(now.loops);
  const bool ended = !now.loops && at_s >= length_s;
  if (change.playing && playing && ended && !change.at_s) at_s = 0;
  now.begin_s = time_s - at_s;
  now.held_s = playing ? std::nullopt : std::optional(at_s);
  object.animation = now;
  return std::nullopt;
}

Json json_of(const relight::VirtualObject& object, double time_s) {
  if (!object.animation) return nullptr;
  const std::vector<relight::Rig::Animation>& all = object.model->rig->animations;
  Json names = Json::array();
  for (const relight::Rig::Animation& animation : all) names.push_back(animation.name);
  const relight::ShownAnimation& shown = *object.animation;
  const double length_s = all[shown.index].length_s;
  return {{"names", names},
          {"name", all[shown.index].name},
          {"playing", !shown.held_s},
          {"loop", shown.loops},
          {"at_s", shown.moment_s(length_s, time_s)},
          {"length_s", length_s}};
}

Json variants_of(const relight::VirtualObject& object) {
  if (!object.default_model) return nullptr;
  const std::vector<relight::Model::Variant>& all = object.default_model->variants;
  Json names = Json::array();
  for (const relight::Model::Variant& variant : all) names.push_back(variant.name);
  return {{"names", names}, {"name", object.variant ? Json(all[*object.variant].name) : Json()}};
}

template <typename T>
Json json_or_null(const std::optional<T>& value) {
  return value ? Json(*value) : Json();
}

Json json_of(const relight::MaterialOverride& material) {
  if (material.empty()) return nullptr;
  const auto color_or_null = [](const std::optional<Eigen::Vector3f>& color) {
    return color ? Json(std::array<float, 3>{color->x(), color->y(), color->z()}) : Json();
  };
  return {{"base_color", color_or_null(material.base_color)},
          {"metallic", json_or_null(material.metallic)},
          {"roughness", json_or_null(material.roughness)},
          {"specular", json_or_null(material.specular)},
          {"emission", color_or_null(material.emission)},
          {"transmission", json_or_null(material.transmission)},
          {"ior", json_or_null(material.ior)},
          {"thin_walled", json_or_null(material.thin_walled)},
          {"attenuation_color", color_or_null(material.attenuation_color)},
          {"attenuation_distance_m", json_or_null(material.attenuation_distance_m)},
          {"clearcoat", json_or_null(material.clearcoat)},
          {"clearcoat_roughness", json_or_null(material.clearcoat_roughness)}};
}

/// A point of the model, as far from the object's place as it is before its rotation.
Json corner(const Eigen::Vector3f& in_model_m, const relight::VirtualObject& object) {
  const Eigen::Vector3d p = object.scale * (in_model_m.cast<double>() - object.origin_m);
  return {p.x(), p.y(), p.z()};
}

/// As many as there are objects if there is none.
std::size_t index_of(const ObjectCommand& command, const relight::Exhibit& exhibit) {
  if (const auto* index = std::get_if<std::size_t>(&command.object)) return *index;
  const auto found =
      std::ranges::find(exhibit.objects, std::get<std::string>(command.object), &relight::VirtualObject::name);
  return static_cast<std::size_t>(found - exhibit.objects.begin());
}

}  // namespace

relight::Exhibit shown_exhibit(const relight::Exhibit& exhibit, const reconstruct::Scene& scene, double time_s,
                               relight::Standing& standing) {
  if (!scene.pose) return exhibit;
  const Eigen::Vector3d up = scene.pose->T_tag_exhibit.linear().col(2);
  return standing.placed(relight::placed_at(exhibit, scene.pose->T_tag_exhibit), scene.field.get(), up.cast<float>(),
                         time_s);
}

ExhibitState::ExhibitState(relight::Exhibit exhibit, ExhibitLimits limits) : limits_(std::move(limits)) {
  begin(std::move(exhibit));
}

void ExhibitState::begin(relight::Exhibit exhibit) {
  configured_ = exhibit;
  rest_.clear();
  yaw_degrees_.clear();
  for (const relight::VirtualObject& object : exhibit.objects) {
    rest_.push_back(object.rotation);
    yaw_degrees_.push_back(0.0);
  }
  exhibit_ = std::make_shared<const relight::Exhibit>(std::move(exhibit));
}

void ExhibitState::replace(relight::Exhibit exhibit, ExhibitLimits limits) {
  const std::lock_guard lock(mutex_);
  limits_ = std::move(limits);
  last_command_.reset();
  begin(std::move(exhibit));
  auto begun = std::make_shared<relight::Exhibit>(*exhibit_);
  for (relight::VirtualObject& object : begun->objects) {
    if (object.animation) object.animation->begin_s += time_s_.value_or(0);  // without frames, `at` does it
  }
  exhibit_ = std::move(begun);
  ++replaced_;
}

std::size_t ExhibitState::replaced() const {
  const std::lock_guard lock(mutex_);
  return replaced_;
}

std::shared_ptr<const relight::Exhibit> ExhibitState::newest() const {
  std::lock_guard lock(mutex_);
  return exhibit_;
}

std::shared_ptr<const relight::Exhibit> ExhibitState::at(double time_s) {
  std::lock_guard lock(mutex_);
  if (!time_s_) {
    auto begun = std::make_shared<relight::Exhibit>(*exhibit_);
    for (relight::VirtualObject& object : begun->objects) {
      if (object.animation) object.animation->begin_s += time_s;
    }
    exhibit_ = std::move(begun);
  }
  time_s_ = time_s;
  return exhibit_;
}

void ExhibitState::give_model(std::size_t index, const relight::GiveModel& give) {
  std::lock_guard lock(mutex_);
  auto next = std::make_shared<relight::Exhibit>(*exhibit_);
  relight::VirtualObject& object = next->objects.at(index);
  give(object);
  give(configured_.objects.at(index));
  if (object.animation) object.animation->begin_s += time_s_.value_or(0);  // without frames, `at` does it
  exhibit_ = std::move(next);
  ++models_given_;
}

std::size_t ExhibitState::models_given() const {
  std::lock_guard lock(mutex_);
  return models_given_;
}

std::optional<relight::VirtualObject> ExhibitState::object(const ObjectCommand& command) const {
  std::lock_guard lock(mutex_);
  const std::size_t index = index_of(command, *exhibit_);
  return index < exhibit_->objects.size() ? std::optional(exhibit_->objects[index]) : std::nullopt;
}

void ExhibitState::reset(relight::Exhibit& exhibit, std::size_t index) {
  relight::VirtualObject& object = exhibit.objects[index];
  object = configured_.objects[index];
  if (object.animation) object.animation->begin_s += time_s_.value_or(0);
  rest_[index] = object.rotation;
  yaw_degrees_[index] = 0;
}

bool ExhibitState::reset_if_idle(Clock::time_point now) {
  std::lock_guard lock(mutex_);
  if (!limits_.reset_after_s || !last_command_ ||
      now - *last_command_ < std::chrono::duration<double>(*limits_.reset_after_s))
    return false;
  last_command_.reset();
  auto next = std::make_shared<relight::Exhibit>(*exhibit_);
  for (std::size_t i = 0; i < next->objects.size(); ++i) reset(*next, i);
  exhibit_ = std::move(next);
  return true;
}

std::optional<std::string> ExhibitState::apply(const ObjectCommand& command, Clock::time_point now) {
  std::lock_guard lock(mutex_);
  auto next = std::make_shared<relight::Exhibit>(*exhibit_);  // models are shared: a copy is small
  const std::size_t index = index_of(command, *next);
  if (index >= next->objects.size()) {
    return "object: there are " + std::to_string(next->objects.size()) + " objects, see hello";
  }
  if (command.reset) reset(*next, index);
  relight::VirtualObject& object = next->objects[index];
  if (command.animation) {
    if (auto error = change_animation(*command.animation, time_s_.value_or(0), object)) return error;
  }
  if (command.variant) {
    if (const auto error = object.show_variant(*command.variant)) return "variant: " + *error;
  }
  if (command.position_m) object.position_m = *command.position_m;
  if (command.position_m && limits_.bounds_m)
    object.position_m = object.position_m.cwiseMax(limits_.bounds_m->min()).cwiseMin(limits_.bounds_m->max());
  if (command.rotation) {
    object.rotation = *command.rotation;
    rest_[index] = object.rotation;
    yaw_degrees_[index] = 0.0;
  }
  if (command.yaw_degrees) {
    yaw_degrees_[index] = *command.yaw_degrees;
    const double yaw_rad = *command.yaw_degrees * std::numbers::pi / 180.0;
    object.rotation = Eigen::AngleAxisd(yaw_rad, Eigen::Vector3d::UnitZ()) * rest_[index];
  }
  if (command.position_m || command.rotation || command.yaw_degrees) object.motion.clear();
  object.visible = command.visible.value_or(object.visible);
  if (command.material) object.material = changed(object.material, *command.material);
  exhibit_ = std::move(next);
  last_command_ = now;
  return std::nullopt;
}

/// As a configuration would state what is shown. The lock is held.
relight::Exhibit ExhibitState::as_start() const {
  relight::Exhibit start = *exhibit_;
  for (relight::VirtualObject& object : start.objects) {
    if (!object.animation) continue;
    const double length_s = object.model->rig->animations[object.animation->index].length_s;
    if (object.animation->held_s) object.animation->held_s = object.animation->moment_s(length_s, time_s_.value_or(0));
    object.animation->begin_s = 0;
  }
  return start;
}

void ExhibitState::save() {
  std::unique_lock lock(mutex_);
  relight::Exhibit start = as_start();
  const std::filesystem::path file = limits_.saved_file;
  const std::size_t replaced = replaced_, given = models_given_;
  lock.unlock();  // a disk may take long
  if (file.empty()) throw std::runtime_error("there is no exhibit file");
  capture::write_text(file, saved_exhibit_text(start));
  lock.lock();
  if (replaced != replaced_) return;  // the next exhibit was read meanwhile
  if (given != models_given_) {       // again, with what only the model knows
    lock.unlock();
    return save();
  }
  for (std::size_t i = 0; i < start.objects.size(); ++i) {
    rest_[i] = exhibit_->objects[i].rotation;
    yaw_degrees_[i] = 0;
  }
  configured_ = std::move(start);
  last_command_.reset();
}

/// Models have up to millions of vertices: their boxes are kept.
const Eigen::AlignedBox3f& ExhibitState::bounds_of(std::size_t index) const {
  bounds_.resize(exhibit_->objects.size());
  Bounds& bounds = bounds_[index];
  const std::shared_ptr<const relight::Model>& model = exhibit_->objects[index].model;
  if (bounds.model != model) {
    bounds = {model, {}};
    if (model)
      for (const Eigen::Vector3f& p : model->positions_m) bounds.box_m.extend(p);
  }
  return bounds.box_m;
}

std::string ExhibitState::objects_json() const {
  std::lock_guard lock(mutex_);
  Json objects = Json::array();
  for (std::size_t i = 0; i < exhibit_->objects.size(); ++i) {
    const relight::VirtualObject& o = exhibit_->objects[i];
    const Eigen::AlignedBox3f& box_m = bounds_of(i);
    objects.push_back(
        Json{{"index", i},
             {"name", o.name},
             {"visible", o.visible},
             {"position_m", {o.position_m.x(), o.position_m.y(), o.position_m.z()}},
             {"rotation_wxyz", {o.rotation.w(), o.rotation.x(), o.rotation.y(), o.rotation.z()}},
             {"yaw_degrees", yaw_degrees_[i]},
             {"scale", o.scale},
             {"bounds_m", box_m.isEmpty() ? Json() : Json{corner(box_m.min(), o), corner(box_m.max(), o)}},
             {"material", json_of(o.material)},
             {"variants", variants_of(o)},
             {"animation", json_of(o, time_s_.value_or(0))}});
  }
  return json_line(objects);
}

}  // namespace lumigraft::server
