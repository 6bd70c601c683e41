#pragma once
// Builds a model of the triangles of a file: grouped by material, equal corners merged to vertices.
#include <Eigen/Geometry>
#include <cstddef>
#include <functional>
#include <map>
#include <memory>
#include <span>
#include <vector>

#include "relight/exhibit/alpha_cutout.h"
#include "relight/exhibit/exhibit.h"
#include "relight/exhibit/model_corners.h"

namespace lumigraft::relight {

/// Rotation that takes the model's up axis, 'x', 'y' or 'z', to z.
Eigen::Matrix3f up_to_z(char up);

/// Whether one of the part's textures has the second set of texture coordinates.
bool reads_second_texcoords(const Model::Part& part);

class ModelBuilder {
 public:
  /// Triangles of one mesh, which have one material.
  class Mesh {
   public:
    /// By indices of vertices, counter-clockwise seen from the front. Triangles of zero area, with NaN, with texture
    /// coordinates beyond what floats resolve, or of vertices that do not exist are dropped and counted.
    void add(std::size_t a, std::size_t b, std::size_t c);
    /// After the last triangle: computes the normals that are missing. Returns the corners.
    std::span<Corner> finish();

   private:
    friend ModelBuilder;
    Mesh(ModelBuilder& builder, std::vector<Corner>& corners, std::vector<Corner> vertices, bool mirrors);

    ModelBuilder& builder_;
    std::vector<Corner>& corners_;
    std::size_t first_;
    std::vector<Corner> vertices_;  // in the model's frame
    bool mirrors_;
  };

  /// `material`: the number by which parts are ordered. Vertices are in the mesh's frame. `triangles`: how many will be
  /// added.
  Mesh mesh(std::size_t material, std::vector<Corner> vertices, std::size_t triangles,
            const Eigen::Affine3f& T_model_mesh);
  /// Of an animated model: at rest in the model's frame, with their numbers as vertices of the rig. `mirrors`:
  /// triangles are traversed in the other direction.
  Mesh mesh_at_rest(std::size_t material, std::vector<Corner> vertices, std::size_t triangles, bool mirrors);

  /// After the last mesh: only the opaque part of materials with a mask remains. If that is nothing, all remains. New
  /// corners of an animated model are numbered in `mixes`.
  void cut_out(const std::map<std::size_t, AlphaMask>& masks, SourceMixes& mixes);

  /// A part per material that has triangles; `part_of` gives all but its indices. The builder is empty afterwards.
  std::shared_ptr<Model> build(const std::function<Model::Part(std::size_t material)>& part_of);

 private:
  std::vector<Corner>& room_for(std::size_t material, std::size_t triangles);

  std::map<std::size_t, std::vector<Corner>> corners_;  // by material
  std::size_t unusable_triangles_ = 0;
};

}  // namespace lumigraft::relight
