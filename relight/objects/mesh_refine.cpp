#include "relight/objects/mesh_refine.h"

#include <algorithm>
#include <array>
#include <map>
#include <utility>

#include "relight/objects/vertex_places.h"

namespace lumigraft::relight {
namespace {

using EdgeIndices = std::pair<std::uint32_t, std::uint32_t>;
using TriangleIndices = std::array<std::uint32_t, 3>;

class Refinement {
 public:
  Refinement(const Model& model, float longest_m) : model_(model), longest_m_(longest_m) {
    model_.indices.clear();
    model_.parts.clear();
  }

  void add(const Model::Part& part, const std::vector<std::uint32_t>& indices) {
    Model::Part& refined = model_.parts.emplace_back(part);
    refined.first_index = static_cast<std::uint32_t>(model_.indices.size());
    for (std::uint32_t i = 0; i + 2 < part.index_count; i += 3) {
      const std::uint32_t* v = &indices[part.first_index + i];
      split({v[0], v[1], v[2]});
    }
    refined.index_count = static_cast<std::uint32_t>(model_.indices.size()) - refined.first_index;
  }

  Model take() { return std::move(model_); }

 private:
  /// Bisects the longest edge, until it is short enough.
  void split(const TriangleIndices& first) {
    std::vector<TriangleIndices> waiting{first};
    while (!waiting.empty()) {
      const TriangleIndices t = waiting.back();
      waiting.pop_back();
      std::size_t longest = 0;
      for (std::size_t i = 1; i < 3; ++i) {
        if (length(t, i) > length(t, longest)) longest = i;
      }
      if (!(length(t, longest) > longest_m_)) {
        model_.indices.insert(model_.indices.end(), t.begin(), t.end());
        continue;
      }
      const std::uint32_t a = t[longest], b = t[(longest + 1) % 3], c = t[(longest + 2) % 3], m = middle(a, b);
      waiting.push_back({a, m, c});
      waiting.push_back({m, b, c});
    }
  }

  float length(const TriangleIndices& t, std::size_t i) const {
    return (model_.positions_m[t[i]] - model_.positions_m[t[(i + 1) % 3]]).norm();
  }

  std::uint32_t middle(std::uint32_t a, std::uint32_t b) {
    const auto [found, is_new] = middles_.try_emplace(EdgeIndices(std::min(a, b), std::max(a, b)),
                                                      static_cast<std::uint32_t>(model_.positions_m.size()));
    if (is_new) add_middle(model_, a, b);
    return found->second;
  }

  Model model_;
  float longest_m_;
  std::map<EdgeIndices, std::uint32_t> middles_;
};

}  // namespace

std::uint32_t add_middle(Model& model, std::uint32_t a, std::uint32_t b) {
  const auto mean = [&](auto& values) {
    if (!values.empty()) values.push_back(0.5f * (values[a] + values[b]));
  };
  mean(model.positions_m);
  mean(model.texcoords);
  mean(model.texcoords_1);
  mean(model.tangents);  // shorter than 1, which no reader of it needs
  mean(model.colors);
  const Eigen::Vector3f normal = model.normals[a] + model.normals[b];
  model.normals.push_back(normal.norm() > 1e-6f ? Eigen::Vector3f(normal.normalized()) : model.normals[a]);
  if (model.rig) {
    model.sources.push_back(static_cast<std::uint32_t>(model.rig->vertices.size() + model.mixes.size()));
    model.mixes.push_back({model.sources[a], model.sources[b], 0.5f});
  }
  return static_cast<std::uint32_t>(model.positions_m.size() - 1);
}

std::shared_ptr<const Model> refine_model(const Model& model, float longest_m) {
  Refinement refinement(model, longest_m);
  for (const Model::Part& part : model.parts) refinement.add(part, model.indices);
  return std::make_shared<Model>(refinement.take());
}

bool is_closed(const Model& model) {
  const std::vector<std::uint32_t> place = vertex_places(model.positions_m).of_vertex;
  std::map<EdgeIndices, int> surplus;  // number of traversals from the lower index to the higher, minus the opposite
  for (std::size_t t = 0; t + 2 < model.indices.size(); t += 3) {
    for (std::size_t i = 0; i < 3; ++i) {
      const std::uint32_t a = place[model.indices[t + i]], b = place[model.indices[t + (i + 1) % 3]];
      surplus[{std::min(a, b), std::max(a, b)}] += a < b ? 1 : -1;
    }
  }
  return std::all_of(surplus.begin(), surplus.end(), [](const auto& edge) { return edge.second == 0; });
}

}  // namespace lumigraft::relight
