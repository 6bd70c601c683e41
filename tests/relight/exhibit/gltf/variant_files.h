#pragma once
// A glTF file with variants of its materials.
#include "tests/relight/exhibit/model_files.h"

namespace lumigraft::test {

/// A grey triangle, and in the variants "red" and "blue" of these colours.
inline GltfFile grey_red_or_blue() {
  GltfFile file;
  for (const auto& color : {nlohmann::json{0.5, 0.5, 0.5, 1}, {1, 0, 0, 1}, {0, 0, 1, 1}})
    file.json["materials"].push_back({{"pbrMetallicRoughness", {{"baseColorFactor", color}}}});
  file.json["extensions"]["KHR_materials_variants"]["variants"] = {{{"name", "red"}}, {{"name", "blue"}}};
  file.primitive()["material"] = 0;
  file.primitive()["extensions"]["KHR_materials_variants"]["mappings"] = {{{"material", 1}, {"variants", {0}}},
                                                                          {{"material", 2}, {"variants", {1}}}};
  return file;
}

}  // namespace lumigraft::test
