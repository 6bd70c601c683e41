#pragma once
// Meshes for [[real_surface]] of a session.
#include <unistd.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "capture/session/session.h"

namespace lumigraft::test {

/// Writes quadrilaterals, counter-clockwise from outside, as a PLY file.
inline capture::RealSurface real_surface(const std::string& name,
                                         const std::vector<std::array<Eigen::Vector3d, 4>>& faces) {
  capture::RealSurface surface;
  surface.name = name;
  surface.mesh = std::filesystem::temp_directory_path() / ("lumigraft-" + std::to_string(::getpid()) + name + ".ply");
  std::ofstream out(surface.mesh);
  out << "ply\nformat ascii 1.0\nelement vertex " << 4 * faces.size()
      << "\nproperty float x\nproperty float y\nproperty float z\nelement face " << 2 * faces.size()
      << "\nproperty list uchar int vertex_indices\nend_header\n";
  for (const auto& face : faces)
    for (const Eigen::Vector3d& corner : face) out << corner.transpose() << '\n';
  for (std::size_t i = 0; i < faces.size(); ++i)
    out << "3 " << 4 * i << ' ' << 4 * i + 1 << ' ' << 4 * i + 2 << "\n3 " << 4 * i << ' ' << 4 * i + 2 << ' '
        << 4 * i + 3 << '\n';
  return surface;
}

/// The six faces of a box transformed by T.
inline std::vector<std::array<Eigen::Vector3d, 4>> box_faces(
    const Eigen::Vector3d& middle, const Eigen::Vector3d& half,
    const Eigen::Isometry3d& T = Eigen::Isometry3d::Identity()) {
  std::vector<std::array<Eigen::Vector3d, 4>> faces;
  for (int axis = 0; axis < 3; ++axis)
    for (const double side : {-1.0, 1.0}) {
      const Eigen::Vector3d n = side * Eigen::Vector3d::Unit(axis), a = Eigen::Vector3d::Unit((axis + 1) % 3),
                            b = side * Eigen::Vector3d::Unit((axis + 2) % 3);
      const auto at = [&](double s, double t) -> Eigen::Vector3d {
        return T * (middle + half.cwiseProduct(n + s * a + t * b));
      };
      faces.push_back({at(-1, -1), at(1, -1), at(1, 1), at(-1, 1)});
    }
  return faces;
}

/// Signed distance to the same box without T.
inline double box(const Eigen::Vector3d& p, const Eigen::Vector3d& middle, const Eigen::Vector3d& half) {
  const Eigen::Vector3d out = (p - middle).cwiseAbs() - half;
  return out.cwiseMax(0.0).norm() + std::min(out.maxCoeff(), 0.0);
}

}  // namespace lumigraft::test
