#include "server/pipeline/saved_exhibit.h"

#include <toml++/toml.h>

#include <map>
#include <sstream>

#include "capture/error.h"
#include "capture/message_text.h"

namespace lumigraft::server {
namespace {

namespace fs = std::filesystem;

constexpr const char* kHead =
    "# Written by \"Save as the exhibit's start\" of lumigraft's page. What is here replaces the same keys of the "
    "exhibit's\n"
    "# own file. Delete this file to go back to that.\n";

toml::array array_of(const auto& values) {
  toml::array array;
  for (const auto value : values) array.push_back(static_cast<double>(value));
  return array;
}

toml::table material_table(const relight::MaterialOverride& material) {
  toml::table table;
  const auto add = [&](const char* key, const auto& value) {
    if (!value) return;
    if constexpr (std::is_same_v<std::decay_t<decltype(*value)>, Eigen::Vector3f>)
      table.insert(key, array_of(*value));
    else if constexpr (std::is_same_v<std::decay_t<decltype(*value)>, bool>)
      table.insert(key, *value);
    else
      table.insert(key, static_cast<double>(*value));
  };
  add("base_color", material.base_color);
  add("metallic", material.metallic);
  add("roughness", material.roughness);
  add("specular", material.specular);
  add("emission", material.emission);
  add("transmission", material.transmission);
  add("ior", material.ior);
  add("thin_walled", material.thin_walled);
  add("attenuation_color", material.attenuation_color);
  add("attenuation_distance_m", material.attenuation_distance_m);
  add("clearcoat", material.clearcoat);
  add("clearcoat_roughness", material.clearcoat_roughness);
  return table;
}

toml::table animation_table(const relight::VirtualObject& object) {
  const relight::ShownAnimation& shown = *object.animation;
  return toml::table{{"name", object.model->rig->animations[shown.index].name},
                     {"playing", !shown.held_s},
                     {"loop", shown.loops},
                     {"at_s", shown.held_s.value_or(0 - shown.begin_s)}};
}

toml::table object_table(const relight::VirtualObject& object) {
  toml::table table{{"name", object.name}, {"visible", object.visible}};
  if (object.motion.empty()) {
    const Eigen::Quaterniond& q = object.rotation;
    table.insert("position_m", array_of(object.position_m));
    table.insert("rotation_wxyz", toml::array{q.w(), q.x(), q.y(), q.z()});
  }
  // The default materials are an empty name.
  if (object.default_model)
    table.insert("variant", object.variant ? object.default_model->variants[*object.variant].name : std::string());
  table.insert("material", material_table(object.material));
  if (object.animation && object.model) table.insert("animation", animation_table(object));
  return table;
}

toml::table parsed(const fs::path& file) {
  try {
    return toml::parse_file(file.string());
  } catch (const toml::parse_error& e) {
    throw capture::InputError(file.string() +
                              ": found a TOML error: " + capture::on_one_line(std::string(e.description())));
  }
}

std::string name_of(const toml::table& object) {
  const fs::path model = object["model"].value_or(std::string());
  return object["name"].value_or(model.stem().string());
}

/// What was saved of an object replaces what its own table says.
void merge(const toml::table& saved, toml::table& object) {
  for (const auto& [key, value] : saved) {
    if (key == "name") continue;
    object.insert_or_assign(key, value);
  }
  if (saved.contains("position_m")) object.erase("motion");
  if (saved["variant"].value_or(std::string("shown")).empty()) object.erase("variant");
}

}  // namespace

fs::path saved_exhibit_file(const fs::path& exhibit) {
  return exhibit.parent_path() / (exhibit.stem().string() + ".saved.toml");
}

std::string saved_exhibit_text(const relight::Exhibit& exhibit) {
  toml::array objects;
  for (const relight::VirtualObject& object : exhibit.objects) objects.push_back(object_table(object));
  std::ostringstream out;
  out << kHead << toml::table{{"object", std::move(objects)}} << '\n';
  return out.str();
}

std::string exhibit_text_with_saved(const fs::path& exhibit, const fs::path& saved,
                                    std::vector<std::string>& warnings) {
  toml::table root = parsed(exhibit);
  const toml::table kept = parsed(saved);
  std::map<std::string, std::vector<toml::table*>> by_name;
  if (toml::array* const objects = root["object"].as_array())
    objects->for_each([&](toml::table& object) { by_name[name_of(object)].push_back(&object); });
  std::map<std::string, std::size_t> taken;
  if (const toml::array* const objects = kept["object"].as_array()) {
    objects->for_each([&](const toml::table& object) {
      const std::string name = name_of(object);
      const std::size_t at = taken[name]++;
      if (at < by_name[name].size())
        merge(object, *by_name[name][at]);
      else
        warnings.push_back(saved.string() + ": object \"" + name + "\" is not in the exhibit any more, and left out");
    });
  }
  std::ostringstream out;
  out << root << '\n';
  return out.str();
}

}  // namespace lumigraft::server
