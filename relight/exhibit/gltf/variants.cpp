#include "relight/exhibit/gltf/variants.h"

#include <algorithm>

#include "relight/exhibit/gltf/parameters.h"

namespace lumigraft::relight {
namespace {

GltfValue variants_of(const GltfValue& of) { return of.extension("KHR_materials_variants"); }

}  // namespace

std::vector<std::string> read_variants(const GltfValue& root) {
  const GltfValue variants = variants_of(root).member("variants");
  if (variants.size() > kGltf.max_variants) {
    variants.fail("found " + std::to_string(variants.size()) + " variants, allowed: at most " +
                  std::to_string(kGltf.max_variants));
  }
  std::vector<std::string> names;
  for (std::size_t i = 0; i < variants.size(); ++i) {
    const GltfValue name = variants[i].member("name");
    if (!name.exists() || name.text().empty() || std::ranges::find(names, name.text()) != names.end())
      name.refuse("a name of its own for each variant");
    names.push_back(name.text());
  }
  return names;
}

GltfValue material_in_variant(const GltfValue& primitive, std::optional<std::size_t> variant) {
  const GltfValue mappings = variants_of(primitive).member("mappings");
  for (std::size_t i = 0; variant && i < mappings.size(); ++i) {
    const GltfValue variants = mappings[i].member("variants");
    for (std::size_t k = 0; k < variants.size(); ++k) {
      if (variants[k].integer(0, kGltf.max_variants) == *variant) return mappings[i].member("material");
    }
  }
  return primitive.member("material");
}

std::vector<GltfValue> materials_of(const GltfValue& primitive) {
  std::vector<GltfValue> all = {primitive.member("material")};
  const GltfValue mappings = variants_of(primitive).member("mappings");
  for (std::size_t i = 0; i < mappings.size(); ++i) all.push_back(mappings[i].member("material"));
  return all;
}

}  // namespace lumigraft::relight
