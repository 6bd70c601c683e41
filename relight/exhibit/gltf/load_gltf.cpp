#include "relight/exhibit/load_gltf.h"

#include <algorithm>
#include <iterator>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "relight/exhibit/gltf/materials.h"
#include "relight/exhibit/gltf/nodes.h"
#include "relight/exhibit/gltf/not_drawn.h"
#include "relight/exhibit/gltf/parameters.h"
#include "relight/exhibit/gltf/primitive.h"
#include "relight/exhibit/gltf/rig_reader.h"
#include "relight/exhibit/gltf/variants.h"
#include "relight/exhibit/model_builder.h"

namespace lumigraft::relight {
namespace {

class GltfLoader {
 public:
  GltfLoader(const std::filesystem::path& file, char up, const LoadProgress& progress)
      : document_(file),
        buffers_(document_, progress),
        accessors_(document_, buffers_),
        textures_(document_, buffers_),
        up_(up_to_z(up)),
        scene_(read_scene(document_.root())) {}

  std::shared_ptr<const Model> load() {
    const std::vector<std::string> variants = read_variants(document_.root());
    const std::shared_ptr<Model> model = in_variant(std::nullopt);
    for (std::size_t i = 0; i < variants.size(); ++i) model->variants.push_back({variants[i], in_variant(i)});
    return model;
  }

 private:
  /// With the materials of a variant, or the default ones.
  std::shared_ptr<Model> in_variant(std::optional<std::size_t> variant) {
    variant_ = variant;
    rig_.emplace(document_, accessors_, scene_, up_);
    used_.clear();
    for (const GltfInstance& instance : scene_.instances) add(instance);
    SourceMixes mixes(static_cast<std::uint32_t>(rig_->vertices()));
    std::set<std::size_t> blended;
    std::ranges::copy_if(used_, std::inserter(blended, blended.end()),
                         [&](std::size_t material) { return parts_.at(material).blends(); });
    std::optional<ModelBuilder> to_cut;
    SourceMixes mixes_of_cut = mixes;
    if (!blended.empty()) to_cut = builder_;
    std::map<std::size_t, AlphaMask> masks = masks_;
    std::erase_if(masks, [&](const auto& of) { return parts_.at(of.first).blends(); });
    builder_.cut_out(masks, mixes);
    const std::shared_ptr<Model> model = builder_.build([&](std::size_t material) { return parts_.at(material); });
    model->rig = rig_->take();
    model->mixes = mixes.take();
    model->not_drawn = gltf_not_drawn(document_, textures_, used_);
    if (!to_cut) return model;
    model->blended = gltf_blended(document_, blended);
    model->cut = cut(*to_cut, *model, std::move(mixes_of_cut));
    return model;
  }

  /// As Model::cut.
  std::shared_ptr<const Model> cut(ModelBuilder& triangles, const Model& whole, SourceMixes mixes) {
    triangles.cut_out(masks_, mixes);
    const std::shared_ptr<Model> model = triangles.build([&](std::size_t material) {
      Model::Part part = parts_.at(material);
      part.opacity_factor = 1;
      part.opacity_texture = {};
      return part;
    });
    model->rig = whole.rig;
    model->mixes = mixes.take();
    return model;
  }

  struct MeshPrimitive {
    GltfValue of;
    GltfPrimitive triangles;
  };

  void add(const GltfInstance& instance) {
    auto [found, is_new] = meshes_.try_emplace(instance.mesh);
    const GltfValue mesh = document_.root().member("meshes")[instance.mesh];
    if (is_new) found->second = read_mesh(mesh);
    for (const auto& [of, primitive] : found->second) {
      vertices_ += primitive.vertices.size();
      if (vertices_ > kGltf.max_elements)
        mesh.fail("found more than " + std::to_string(kGltf.max_elements) + " vertices up to here, allowed: as many");
      triangles_ += primitive.indices.size() / 3;
      if (triangles_ > kGltf.max_triangles) {
        mesh.fail("found more than " + std::to_string(kGltf.max_triangles) + " triangles up to here, allowed: as many");
      }
      const GltfValue reference = material_in_variant(of, variant_);
      const std::size_t material = read(reference);
      if (reference.exists()) used_.insert(material);
      ModelBuilder::Mesh to = mesh_of(instance, of, material, primitive);
      for (std::size_t i = 0; i < primitive.indices.size(); i += 3)
        to.add(primitive.indices[i], primitive.indices[i + 1], primitive.indices[i + 2]);
      rig_->add_normals(to.finish());
    }
  }

  ModelBuilder::Mesh mesh_of(const GltfInstance& instance, const GltfValue& of, std::size_t material,
                             const GltfPrimitive& primitive) {
    const std::size_t triangles = primitive.indices.size() / 3;
    if (!rig_->used())
      return builder_.mesh(material, primitive.vertices, triangles, Eigen::Affine3f(up_) * instance.T_file_mesh);
    GltfRig::AtRest at_rest = rig_->add(instance, of, primitive);
    return builder_.mesh_at_rest(material, std::move(at_rest.vertices), triangles, at_rest.mirrors);
  }

  /// With what the materials of any variant need.
  std::vector<MeshPrimitive> read_mesh(const GltfValue& mesh) {
    std::vector<MeshPrimitive> all;
    const GltfValue primitives = mesh.member("primitives");
    for (std::size_t i = 0; i < primitives.size(); ++i) {
      if (!has_triangles(primitives[i])) continue;
      GltfNeeds needs{.rig = rig_->used()};
      for (const GltfValue& reference : materials_of(primitives[i])) {
        const Model::Part& part = parts_.at(read(reference));
        needs.second_texcoords = needs.second_texcoords || reads_second_texcoords(part);
        needs.tangents = needs.tangents || part.normal_texture.picture || part.clearcoat_normal_texture.picture ||
                         part.anisotropy_factor > 0;
      }
      all.push_back({primitives[i], read_primitive(document_, buffers_, accessors_, primitives[i], needs)});
    }
    return all;
  }

  /// The number of a material, that of no material being the highest.
  std::size_t read(const GltfValue& reference) {
    const GltfValue materials = document_.root().member("materials");
    const std::size_t count = materials.size(),
                      material = reference.exists() ? reference.index(count, "materials") : count;
    if (!parts_.contains(material)) {
      const GltfValue of = material < count ? materials[material] : materials.none();
      parts_[material] = read_material(of, textures_);
      if (auto mask = read_alpha(of, parts_[material], textures_)) masks_[material] = std::move(*mask);
    }
    return material;
  }

  GltfDocument document_;
  GltfBuffers buffers_;
  GltfAccessors accessors_;
  GltfTextures textures_;
  Eigen::Matrix3f up_;
  GltfScene scene_;
  std::map<std::size_t, std::vector<MeshPrimitive>> meshes_;  // by index of the mesh
  std::map<std::size_t, Model::Part> parts_;                  // by number of the material
  std::map<std::size_t, AlphaMask> masks_;                    // likewise
  std::size_t triangles_ = 0, vertices_ = 0;                  // of all instances in all variants
  // Of one variant.
  std::optional<std::size_t> variant_;
  std::optional<GltfRig> rig_;
  ModelBuilder builder_;
  std::set<std::size_t> used_;  // materials, by number
};

}  // namespace

std::shared_ptr<const Model> load_gltf(const std::filesystem::path& file, char up, const LoadProgress& progress) {
  return GltfLoader(file, up, progress).load();
}

}  // namespace lumigraft::relight
