#include "relight/exhibit/exhibit.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>
#include <utility>

#include "capture/error.h"
#include "capture/message_text.h"
#include "relight/animation/pose.h"
#include "relight/exhibit/loading.h"

namespace lumigraft::relight {
namespace {

/// Of one exhibit.
using ModelCache = std::map<std::pair<std::filesystem::path, char>, std::shared_ptr<const Model>>;

Eigen::Vector3d read_position(const capture::ConfigTable& table, const Eigen::Vector3d& fallback) {
  if (!table.has("position_m")) return fallback;
  const std::vector<double> p = table.numbers("position_m", 3);
  return {p[0], p[1], p[2]};
}

Eigen::Quaterniond read_rotation(const capture::ConfigTable& table, const Eigen::Quaterniond& fallback) {
  if (!table.has("rotation_wxyz")) return fallback;
  const std::vector<double> q = table.numbers("rotation_wxyz", 4);
  const Eigen::Quaterniond rotation(q[0], q[1], q[2], q[3]);
  const double length = rotation.norm();
  if (!(length > 1e-9 && std::isfinite(length))) {
    table.fail("rotation_wxyz",
               "found a quaternion of length " + std::to_string(length) + ", allowed: one that can be normalised");
  }
  return Eigen::Quaterniond(rotation.coeffs() / length);
}

std::optional<float> read_unit(const capture::ConfigTable& table, const char* key) {
  if (!table.has(key)) return std::nullopt;
  return static_cast<float>(table.number(key, 0.0, 1.0));
}

/// `kind`: of its three numbers, from 0 to `max`.
std::optional<Eigen::Vector3f> read_color(const capture::ConfigTable& table, const char* key, double max,
                                          const std::string& kind) {
  if (!table.has(key)) return std::nullopt;
  const std::vector<double> color = table.numbers(key, 3);
  if (*std::min_element(color.begin(), color.end()) < 0 || *std::max_element(color.begin(), color.end()) > max) {
    table.fail(
        key, "found a value outside 0 to " + std::to_string(static_cast<int>(max)) + ", allowed: three linear " + kind);
  }
  return Eigen::Vector3d(color[0], color[1], color[2]).cast<float>();
}

MaterialOverride read_material(const capture::ConfigTable& table) {
  MaterialOverride material;
  material.base_color = read_color(table, "base_color", 1, "reflectances from 0 to 1");
  material.metallic = read_unit(table, "metallic");
  material.roughness = read_unit(table, "roughness");
  material.specular = read_unit(table, "specular");
  material.emission = read_color(table, "emission", kMaxEmission, "radiances, 1 being the white of the picture");
  material.transmission = read_unit(table, "transmission");
  if (table.has("ior")) material.ior = static_cast<float>(table.number("ior", 1.0, kMaxIor));
  if (table.has("thin_walled")) material.thin_walled = table.flag("thin_walled", false);
  material.attenuation_color = read_color(table, "attenuation_color", 1, "transmittances from 0 to 1");
  if (table.has("attenuation_distance_m")) {
    material.attenuation_distance_m = static_cast<float>(
        table.number("attenuation_distance_m", kMinAttenuationDistance_m, kMaxAttenuationDistance_m));
  }
  material.clearcoat = read_unit(table, "clearcoat");
  material.clearcoat_roughness = read_unit(table, "clearcoat_roughness");
  return material;
}

std::vector<KeyFrame> read_motion(const capture::ConfigTable& table, const VirtualObject& object) {
  std::vector<KeyFrame> motion;
  for (const capture::ConfigTable& entry : table.tables("motion")) {
    KeyFrame key;
    key.time_s = entry.number("time_s", -1e9, 1e9);
    key.position_m = read_position(entry, object.position_m);
    key.rotation = read_rotation(entry, object.rotation);
    if (!motion.empty() && key.time_s < motion.back().time_s) {
      entry.fail("time_s", "found " + std::to_string(key.time_s) + ", allowed: no earlier than the key frame before, " +
                               std::to_string(motion.back().time_s));
    }
    motion.push_back(key);
  }
  return motion;
}

/// Its longest edge has the size, and the middle of its underside is at its position.
void place_by_size(double size_m, VirtualObject& object) {
  Eigen::AlignedBox3f box;
  for (const Eigen::Vector3f& p : object.model->positions_m) box.extend(p);
  object.scale = size_m / static_cast<double>(box.sizes().maxCoeff());
  object.origin_m = {box.center().x(), box.center().y(), box.min().z()};
}

/// The keys of an object that only its model can answer.
struct ModelKeys {
  struct Animation {
    capture::ConfigTable table;
    std::optional<std::string> name;
    bool loops, playing;
    double at_s;
  };
  capture::ConfigTable table;
  double size_m;  ///< 0: none
  std::optional<std::string> variant;
  std::optional<Animation> animation;

  explicit ModelKeys(const capture::ConfigTable& of) : table(of), size_m(of.number("size_m", 1e-3, 1e3, 0.0)) {
    if (of.has("variant")) variant = of.text("variant");
    const auto keys = of.optional_table("animation");
    if (!keys) return;
    std::optional<std::string> name;
    if (keys->has("name")) name = keys->text("name");
    const bool loops = keys->flag("loop", true);
    const double at_s = keys->number("at_s", 0.0, 1e6, 0.0);
    animation = Animation{*keys, std::move(name), loops, keys->flag("playing", true), at_s};
  }
};

/// Of the model's animations, the first if no other is named; nothing if it has none.
std::optional<ShownAnimation> shown_animation(const ModelKeys& of, const Model& model) {
  const std::optional<ModelKeys::Animation>& keys = of.animation;
  if (!model.rig) {
    if (keys) of.table.fail("animation", "found a model without animations, allowed: one with an animation");
    return std::nullopt;
  }
  ShownAnimation shown;
  if (!keys) return shown;
  const std::vector<Rig::Animation>& all = model.rig->animations;
  if (keys->name) {
    const std::string& name = *keys->name;
    const auto found = std::ranges::find(all, name, &Rig::Animation::name);
    if (found == all.end()) {
      std::vector<std::string> names;
      for (const Rig::Animation& animation : all) names.push_back("\"" + animation.name + "\"");
      keys->table.fail("name", "found \"" + name + "\", allowed: " + capture::listed(names));
    }
    shown.index = static_cast<std::size_t>(found - all.begin());
  }
  shown.loops = keys->loops;
  if (keys->playing)
    shown.begin_s = -keys->at_s;
  else
    shown.held_s = keys->at_s;
  return shown;
}

void give_model(const ModelKeys& keys, const std::shared_ptr<const Model>& model, VirtualObject& object) {
  object.model = model;
  if (!model->variants.empty()) object.default_model = model;
  object.animation = shown_animation(keys, *model);
  if (keys.size_m > 0) place_by_size(keys.size_m, object);
  if (!keys.variant) return;
  if (const auto error = object.show_variant(keys.variant)) keys.table.fail("variant", *error);
}

struct ReadObject {
  VirtualObject object;  ///< without its model
  std::uintmax_t model_bytes = 0;
  std::function<GiveModel(const LoadProgress&)> load;
};

ReadObject read_object(const capture::ConfigTable& table, const std::shared_ptr<ModelCache>& cache) {
  VirtualObject object;
  const std::filesystem::path file = table.existing_file("model");
  const std::string extension = file.extension().string();
  const bool gltf = extension == ".gltf" || extension == ".glb" || extension == ".GLTF" || extension == ".GLB";
  const char up = table.choice("up", {"x", "y", "z"}, gltf ? "y" : "z").front();
  object.name = table.text("name", file.stem().string());
  object.position_m = read_position(table, object.position_m);
  object.rotation = read_rotation(table, object.rotation);
  if (table.has("size_m") && table.has("scale"))
    table.fail("size_m", "found together with scale, allowed: one of both");
  object.scale = table.number("scale", 1e-6, 1e6, 1.0);
  table.obsolete("rigid");
  object.visible = table.flag("visible", true);
  object.stands = table.choice("on", {"tag", "table"}, "tag") == "table";
  object.motion = read_motion(table, object);

  if (const auto material = table.optional_table("material")) object.material = read_material(*material);
  const auto load = [keys = ModelKeys(table), cache, file, up](const LoadProgress& progress) -> GiveModel {
    std::shared_ptr<const Model>& model = (*cache)[{file, up}];
    try {
      if (!model) model = load_model(file, up, progress);
    } catch (const capture::InputError& error) {
      keys.table.fail("model", error.what());
    }
    return [keys, model](VirtualObject& loaded) { give_model(keys, model, loaded); };
  };
  return {std::move(object), std::filesystem::file_size(file), load};
}

}  // namespace

Eigen::Affine3d VirtualObject::T_tag_model(double time_s) const {
  KeyFrame at{time_s, position_m, rotation};
  if (!motion.empty()) {
    const auto after = std::upper_bound(motion.begin(), motion.end(), time_s,
                                        [](double t, const KeyFrame& key) { return t < key.time_s; });
    const KeyFrame& b = after == motion.end() ? motion.back() : *after;
    const KeyFrame& a = after == motion.begin() ? motion.front() : *(after - 1);
    const double span_s = b.time_s - a.time_s;
    const double s = span_s > 0 ? (time_s - a.time_s) / span_s : 0.0;
    at.position_m = a.position_m + s * (b.position_m - a.position_m);
    at.rotation = a.rotation.slerp(s, b.rotation);
  }
  return Eigen::Translation3d(at.position_m) * at.rotation * Eigen::Scaling(scale) * Eigen::Translation3d(-origin_m);
}

double ShownAnimation::moment_s(double length_s, double time_s) const {
  const double at_s = held_s.value_or(time_s - begin_s);
  if (held_s || !loops || !(length_s > 0)) return std::clamp(at_s, 0.0, length_s);
  const double into_s = std::fmod(at_s, length_s);
  return into_s < 0 ? into_s + length_s : into_s;
}

RigPose VirtualObject::pose(double time_s) const {
  if (!animation || !model || !model->rig) return {};
  const Rig& rig = *model->rig;
  return pose_at(rig, animation->index, animation->moment_s(rig.animations[animation->index].length_s, time_s));
}

std::optional<std::string> VirtualObject::show_variant(const std::optional<std::string>& name_of_variant) {
  if (!default_model && !name_of_variant) return std::nullopt;
  if (!default_model)
    return "found \"" + *name_of_variant + "\", allowed: none, as the model has no variants of its materials";
  const std::vector<Model::Variant>& all = default_model->variants;
  const auto found = name_of_variant ? std::ranges::find(all, *name_of_variant, &Model::Variant::name) : all.end();
  if (name_of_variant && found == all.end()) {
    std::vector<std::string> names;
    for (const Model::Variant& allowed : all) names.push_back("\"" + allowed.name + "\"");
    return "found \"" + *name_of_variant + "\", allowed: " + capture::listed(names);
  }
  variant.reset();
  if (name_of_variant) variant = static_cast<std::size_t>(found - all.begin());
  model = variant ? all[*variant].model : default_model;
  return std::nullopt;
}

bool VirtualObject::drawn(double time_s) const { return visible && model && has_extent(pose(time_s)); }

Exhibit placed_at(Exhibit exhibit, const Eigen::Isometry3d& T_tag_exhibit) {
  const Eigen::Quaterniond turn(T_tag_exhibit.linear());
  for (VirtualObject& object : exhibit.objects) {
    object.position_m = T_tag_exhibit * object.position_m;
    object.rotation = turn * object.rotation;
    for (KeyFrame& key : object.motion) {
      key.position_m = T_tag_exhibit * key.position_m;
      key.rotation = turn * key.rotation;
    }
  }
  return exhibit;
}

Exhibit read_exhibit(const capture::ConfigTable& root) {
  return read_exhibit(root, std::numeric_limits<std::uintmax_t>::max(), nullptr);
}

Exhibit read_exhibit(const capture::ConfigTable& root, std::uintmax_t max_model_bytes,
                     std::vector<UnloadedObject>* later) {
  Exhibit exhibit;
  const auto cache = std::make_shared<ModelCache>();
  std::set<std::string> names;
  for (const capture::ConfigTable& table : root.tables("object")) {
    ReadObject read = read_object(table, cache);
    const std::string name = read.object.name;
    if (read.model_bytes > max_model_bytes)
      later->push_back({exhibit.objects.size(), name, std::move(read.load)});
    else
      read.load({})(read.object);
    exhibit.objects.push_back(std::move(read.object));
    if (!names.insert(name).second) {
      table.fail(table.has("name") ? "name" : "model",
                 "found a second object named \"" + name + "\", allowed: a name of its own for each");
    }
  }
  return exhibit;
}

}  // namespace lumigraft::relight
