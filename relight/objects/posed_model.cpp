#include "relight/objects/posed_model.h"

#include <utility>

namespace lumigraft::relight {
namespace {

/// Appends the points between vertices of the rig.
void add_mixes(const std::vector<Model::Mix>& mixes, PosedVertices& of) {
  const std::size_t count = of.positions_m.size() + mixes.size();
  of.positions_m.reserve(count);
  of.normals.reserve(count);
  of.tangents.reserve(count);
  for (const auto& [a, b, t] : mixes) {
    of.positions_m.push_back(of.positions_m[a] + t * (of.positions_m[b] - of.positions_m[a]));
    of.normals.push_back((of.normals[a] + t * (of.normals[b] - of.normals[a])).stableNormalized());
    of.tangents.push_back(of.tangents[a] + t * (of.tangents[b] - of.tangents[a]));
  }
}

std::shared_ptr<const Model> placed(const Model& model, const PosedVertices& sources) {
  auto posed = std::make_shared<Model>(model);
  for (std::size_t v = 0; v < model.sources.size(); ++v) {
    const std::uint32_t source = model.sources[v];
    if (sources.positions_m[source].allFinite()) posed->positions_m[v] = sources.positions_m[source];
    if (!sources.normals[source].isZero(0)) posed->normals[v] = sources.normals[source];
    if (!posed->tangents.empty()) posed->tangents[v] = sources.tangents[source];
  }
  return posed;
}

}  // namespace

std::shared_ptr<const Model> posed_model(const Model& model, const PosedVertices& rig) {
  if (model.mixes.empty()) return placed(model, rig);
  PosedVertices sources = rig;
  add_mixes(model.mixes, sources);
  return placed(model, sources);
}

std::shared_ptr<const Model> posed_model(const std::shared_ptr<const Model>& model, const RigPose& pose) {
  return pose.at_rest() ? model : posed_model(*model, skinned(*model->rig, pose));
}

}  // namespace lumigraft::relight
