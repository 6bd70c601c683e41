#include "relight/tracing/trace_scene.h"

#include <algorithm>

namespace lumigraft::relight {

bool same_meshes(const std::vector<ReferenceMesh>& a, const std::vector<ReferenceMesh>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const ReferenceMesh& x, const ReferenceMesh& y) {
    return x.model == y.model && x.T_tag_model.matrix() == y.T_tag_model.matrix() && x.material == y.material;
  });
}

}  // namespace lumigraft::relight
