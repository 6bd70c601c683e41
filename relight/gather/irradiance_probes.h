#pragma once
// Where irradiance is gathered on an object: places some way apart on both sides of its surface (on the outer side
// alone where it is closed), and how its vertices mix them. In the model's own frame: a rigid object keeps them.
#include <cstdint>
#include <memory>
#include <vector>

#include "relight/tracing/meshes.h"

namespace lumigraft::relight {

struct IrradianceProbes {
  struct Place {
    Eigen::Vector3f position_m, normal;  ///< unit, on its side
  };
  struct Share {
    int place = 0;
    float weight = 0;
  };

  std::shared_ptr<const Model> model;  ///< finely divided
  std::shared_ptr<const ModelTree> tree;
  bool closed = false;
  std::vector<Place> places;
  std::vector<Share> shares;  ///< of vertex v's front those from first[v] to first[v + 1]; backs after all fronts
  std::vector<std::uint32_t> first;  ///< 2 · vertices + 1; a side without places has none
};

IrradianceProbes place_probes(const Model& model);

}  // namespace lumigraft::relight
