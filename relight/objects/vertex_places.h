#pragma once
// Vertices of a model at one place: files repeat them at seams of texture coordinates, sometimes with other rounding.
#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <vector>

namespace lumigraft::relight {

struct VertexPlaces {
  std::vector<std::uint32_t> of_vertex;  ///< numbers from 0 on
  std::size_t count = 0;
};

/// Vertices are at one place if they are apart by at most 2^-20 of the longest edge of their box along each axis:
/// single precision resolves 2^-23.
VertexPlaces vertex_places(const std::vector<Eigen::Vector3f>& positions_m);

}  // namespace lumigraft::relight
