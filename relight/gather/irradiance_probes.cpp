#include "relight/gather/irradiance_probes.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <unordered_map>

#include "relight/gather/parameters.h"
#include "relight/objects/mesh_refine.h"
#include "relight/objects/mesh_simplify.h"
#include "relight/objects/placement.h"
#include "relight/objects/posed_model.h"

namespace lumigraft::relight {
namespace {

using Eigen::Vector3f;

struct VertexSide {
  Vector3f position_m, normal;
};

std::int64_t key_of(const Eigen::Vector3i& cell) {
  std::int64_t key = 0;
  for (int i = 0; i < 3; ++i) key = key << 20 | ((cell[i] + (1 << 19)) & 0xfffff);
  return key;
}

int facing(const Vector3f& normal) {
  int axis = 0;
  normal.cwiseAbs().maxCoeff(&axis);
  return 2 * axis + (normal[axis] < 0 ? 1 : 0);
}

}  // namespace

IrradianceProbes place_probes(const Model& coarse) {
  IrradianceProbes found;
  const BoundingSphere sphere = bounding_sphere(coarse.positions_m);
  const float edge_m = sphere.radius_m / kGather.probes_across;
  found.model = refine_model(coarse, edge_m);
  found.tree = std::make_shared<const ModelTree>(found.model);
  // Rays also meet blended surfaces from inside.
  found.closed = is_closed(coarse) && std::ranges::none_of(coarse.parts, &Model::Part::blends);
  const Model& model = *found.model;

  std::vector<VertexSide> sides;
  for (std::size_t v = 0; v < model.positions_m.size(); ++v) sides.push_back({model.positions_m[v], model.normals[v]});
  if (!found.closed) {
    for (std::size_t v = 0; v < model.positions_m.size(); ++v)
      sides.push_back({model.positions_m[v], -model.normals[v]});
  }
  const auto cell_of = [&](const Vector3f& p) {
    return ((p - sphere.centre_m) / edge_m).array().floor().matrix().cast<int>().eval();
  };

  // The mean of the vertices with similar normals in a cell, and the vertex nearest to it.
  struct Cell {
    std::array<Vector3f, 6> sum;
    std::array<int, 6> count{}, place{-1, -1, -1, -1, -1, -1};
    std::array<float, 6> min_off;
  };
  std::unordered_map<std::int64_t, Cell> cells;
  for (const VertexSide& side : sides) {
    Cell& cell = cells[key_of(cell_of(side.position_m))];
    const auto f = static_cast<std::size_t>(facing(side.normal));
    if (cell.count[f]++ == 0) cell.sum[f].setZero();
    cell.sum[f] += side.position_m;
    cell.min_off[f] = std::numeric_limits<float>::infinity();
  }
  for (std::uint32_t s = 0; s < sides.size(); ++s) {
    const VertexSide& side = sides[s];
    Cell& cell = cells[key_of(cell_of(side.position_m))];
    const auto f = static_cast<std::size_t>(facing(side.normal));
    const float off = (cell.sum[f] / static_cast<float>(cell.count[f]) - side.position_m).squaredNorm();
    if (off >= cell.min_off[f]) continue;
    cell.min_off[f] = off;
    if (cell.place[f] < 0) {
      cell.place[f] = static_cast<int>(found.places.size());
      found.places.emplace_back();
      found.sides.emplace_back();
    }
    found.sides[static_cast<std::size_t>(cell.place[f])] = s;
    found.places[static_cast<std::size_t>(cell.place[f])] = {side.position_m, side.normal};
  }

  auto interpolation = std::make_shared<IrradianceProbes::Interpolation>();
  auto& [weights, first] = *interpolation;
  for (const VertexSide& side : sides) {
    first.push_back(static_cast<std::uint32_t>(weights.size()));
    float sum = 0;
    // The eight cells whose centres surround the vertex.
    const Eigen::Vector3i low = cell_of(side.position_m - Vector3f::Constant(0.5f * edge_m));
    for (int i = 0; i < 8; ++i) {
      const auto cell = cells.find(key_of(low + Eigen::Vector3i(i & 1, i >> 1 & 1, i >> 2)));
      if (cell == cells.end()) continue;
      for (const int place : cell->second.place) {
        if (place < 0) continue;
        const auto& p = found.places[static_cast<std::size_t>(place)];
        const float turn = p.normal.dot(side.normal),
                    off = (p.position_m - side.position_m).norm() / (kGather.probe_reach * edge_m);
        if (turn <= 0 || off >= 1) continue;
        const float weight = std::pow(turn, kGather.probe_exponent) * (1 - off) * (1 - off);
        weights.push_back({place, weight});
        sum += weight;
      }
    }
    const std::size_t begin = first.back();
    if (sum <= 0) {  // a single vertex whose position is out of reach of all probes: uses its own cell's probe
      const Cell& own = cells[key_of(cell_of(side.position_m))];
      weights.push_back({own.place[static_cast<std::size_t>(facing(side.normal))], 1});
      sum = 1;
    }
    for (std::size_t i = begin; i < weights.size(); ++i) weights[i].weight /= sum;
  }
  first.resize(2 * model.positions_m.size() + 1, static_cast<std::uint32_t>(weights.size()));
  found.interpolation = std::move(interpolation);
  return found;
}

std::shared_ptr<const IrradianceProbes> posed_probes(const IrradianceProbes& at_rest, const RigPose& pose,
                                                     PosedTrees& trees) {
  auto posed = std::make_shared<IrradianceProbes>();
  posed->model = posed_model(at_rest.model, pose);
  posed->tree = trees.at(posed->model, *at_rest.tree);
  posed->closed = at_rest.closed;
  posed->sides = at_rest.sides;
  posed->interpolation = at_rest.interpolation;
  const Model& model = *posed->model;
  const std::size_t vertices = model.positions_m.size();
  posed->places.reserve(at_rest.sides.size());
  for (const std::uint32_t side : at_rest.sides) {
    const std::size_t v = side % vertices;
    posed->places.push_back({model.positions_m[v], side < vertices ? model.normals[v] : Vector3f(-model.normals[v])});
  }
  return posed;
}

std::shared_ptr<const IrradianceProbes> make_ray_model(const std::shared_ptr<const Model>& model) {
  return std::make_shared<const IrradianceProbes>(place_probes(*simplify_model(*model, kGather.max_triangles)));
}

}  // namespace lumigraft::relight
