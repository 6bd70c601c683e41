#pragma once
// Irradiance probes on an object: points distributed over both sides of its surface (the outer side only if it is
// closed), and the interpolation weights from probes to vertices. In the model's frame: constant for a rigid object.
// Those of an animated one are vertices, which move with its surface.
#include <cstdint>
#include <memory>
#include <vector>

#include "relight/objects/prepared_models.h"
#include "relight/tracing/meshes.h"

namespace lumigraft::relight {

struct IrradianceProbes {
  struct Place {
    Eigen::Vector3f position_m, normal;  ///< unit, on the probe's side
  };
  struct ProbeWeight {
    int place = 0;
    float weight = 0;
  };

  std::shared_ptr<const Model> model;  ///< subdivided
  std::shared_ptr<const ModelTree> tree;
  bool closed = false;
  std::vector<Place> places;
  std::vector<std::uint32_t> sides;  ///< by place: the vertex whose front it is, or the number of vertices + that
  /// From probes to vertices; the same for all poses.
  struct Interpolation {
    std::vector<ProbeWeight> weights;  ///< vertex v's front uses first[v] to first[v + 1]; backs follow all fronts
    std::vector<std::uint32_t> first;  ///< 2 · vertices + 1; a side without probes has an empty range
  };
  std::shared_ptr<const Interpolation> interpolation;
};

IrradianceProbes place_probes(const Model& model);

/// The same probes where a pose of the model has them.
std::shared_ptr<const IrradianceProbes> posed_probes(const IrradianceProbes& at_rest, const RigPose& pose,
                                                     PosedTrees& trees);

using RayModels = PreparedModels<IrradianceProbes>;
/// Of the model, simplified if it has very many triangles. Takes up to seconds.
std::shared_ptr<const IrradianceProbes> make_ray_model(const std::shared_ptr<const Model>& model);

}  // namespace lumigraft::relight
