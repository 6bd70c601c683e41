#include "relight/objects/mesh_simplify.h"

#include <meshoptimizer.h>

#include <algorithm>

namespace lumigraft::relight {
namespace {

std::vector<std::uint32_t> simplified(const Model& model, const Model::Part& part, std::size_t target_count) {
  const std::uint32_t* indices = model.indices.data() + part.first_index;
  const float* positions = model.positions_m.front().data();
  const std::size_t vertices = model.positions_m.size(), stride = sizeof(Eigen::Vector3f);
  constexpr float any_error = 1.0f;  // relative to the model's size; only the triangle count limits
  std::vector<std::uint32_t> out(part.index_count);
  out.resize(meshopt_simplify(out.data(), indices, part.index_count, positions, vertices, stride, target_count,
                              any_error, 0, nullptr));
  if (out.size() <= target_count + target_count / 4) return out;
  std::vector<std::uint32_t> clustered(part.index_count);
  clustered.resize(meshopt_simplifySloppy(clustered.data(), indices, part.index_count, positions, vertices, stride,
                                          target_count, any_error, nullptr));
  return clustered.empty() ? out : clustered;
}

}  // namespace

std::shared_ptr<const Model> simplify_model(const Model& model, int max_triangles) {
  const std::size_t max_count = 3 * static_cast<std::size_t>(std::max(max_triangles, 1));
  if (model.indices.size() <= max_count) return std::make_shared<Model>(model);

  auto result = std::make_shared<Model>();
  for (const Model::Part& part : model.parts) {
    const std::size_t max_indices = part.index_count * max_count / model.indices.size() / 3 * 3;
    const std::vector<std::uint32_t> indices = simplified(model, part, std::max<std::size_t>(max_indices, 3));
    Model::Part& smaller = result->parts.emplace_back(part);
    smaller.first_index = static_cast<std::uint32_t>(result->indices.size());
    smaller.index_count = static_cast<std::uint32_t>(indices.size());
    result->indices.insert(result->indices.end(), indices.begin(), indices.end());
  }

  // Keeps only the used vertices, in order of use.
  std::vector<std::uint32_t> remap(model.positions_m.size());
  const std::size_t used =
      meshopt_optimizeVertexFetchRemap(remap.data(), result->indices.data(), result->indices.size(), remap.size());
  meshopt_remapIndexBuffer(result->indices.data(), result->indices.data(), result->indices.size(), remap.data());
  const auto keep = [&]<typename T>(const std::vector<T>& from, std::vector<T>* to) {
    if (from.empty()) return;
    to->resize(used);
    meshopt_remapVertexBuffer(to->data(), from.data(), from.size(), sizeof(T), remap.data());
  };
  keep(model.positions_m, &result->positions_m);
  keep(model.normals, &result->normals);
  keep(model.texcoords, &result->texcoords);
  keep(model.texcoords_1, &result->texcoords_1);
  keep(model.tangents, &result->tangents);
  keep(model.colors, &result->colors);
  keep(model.sources, &result->sources);
  result->rig = model.rig;
  result->mixes = model.mixes;
  return result;
}

}  // namespace lumigraft::relight
