#include "reconstruct/field/normal_filter.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "reconstruct/field/parameters.h"
#include "reconstruct/math/depth_noise.h"
#include "reconstruct/math/median.h"
#include "reconstruct/math/simd4.h"

namespace lumigraft::reconstruct {
namespace {

using Eigen::Vector3f;

constexpr const FieldParameters::NormalFilter& kFilter = kFieldParameters.normal_filter;

Simd4 simd_of(const Vector3f& v) { return Simd4{v.x(), v.y(), v.z(), 0}; }

float squared_length(const Simd4& v) { return v[0] * v[0] + v[1] * v[1] + v[2] * v[2]; }

/// Standard deviation of the distance at each vertex in that of a measurement of weight 1; 0: unknown.
std::vector<float> relative_noise(const DistanceField& field, const SurfaceMesh& mesh) {
  std::vector<float> noise;
  for (const Vector3f& p_m : mesh.vertices_m) {
    const Eigen::Vector3i voxel = (p_m / field.voxel_m).array().round().matrix().cast<int>();
    const FieldBrick* brick = field.brick(brick_of(voxel));
    const float weight = brick ? brick->weight[static_cast<std::size_t>(index_in_brick(voxel))] : 0;
    noise.push_back(weight > 0 ? 1 / std::sqrt(weight) : 0);
  }
  return noise;
}

/// A vertex, three coordinates each and 0.
struct Vertex {
  Simd4 position_m, normal;
};

/// Weighted means of the normals around vertices. Neighbours are not even around a vertex of marching cubes: what
/// their centre's offset changes on curved surface is subtracted, with the curvature that they show.
class NormalMeans {
 public:
  explicit NormalMeans(const std::vector<Vertex>& vertices)
      : vertices_(vertices), sums_(vertices.size(), Sums{Simd4{}, Simd4{}}) {}

  void add(std::size_t a, std::size_t b, float weight) {
    const Vertex &of_a = vertices_[a], &of_b = vertices_[b];
    const Simd4 along = of_b.position_m - of_a.position_m, turn = of_b.normal - of_a.normal;
    const float square = squared_length(along),
                bend = weight * (turn[0] * along[0] + turn[1] * along[1] + turn[2] * along[2]);
    const Simd4 last_bend = {0, 0, 0, bend}, last_length = {0, 0, 0, weight * square};
    sums_[a].normals += weight * of_b.normal + last_bend;
    sums_[b].normals += weight * of_a.normal + last_bend;
    sums_[a].offsets += weight * along + last_length;
    sums_[b].offsets += last_length - weight * along;
  }
  /// The sum with that of the vertex itself, which has the weight `own`.
  Simd4 sum(std::size_t i, float own) const {
    Simd4 normals = sums_[i].normals, offset = sums_[i].offsets;
    const float curvature = offset[3] > 0 ? normals[3] / offset[3] : 0;
    normals[3] = offset[3] = 0;
    return own * vertices_[i].normal + normals - curvature * offset;
  }

 private:
  /// The last of `normals` is the sum of bends, that of `offsets` of squared lengths.
  struct Sums {
    Simd4 normals, offsets;
  };
  const std::vector<Vertex>& vertices_;
  std::vector<Sums> sums_;
};

/// 1σ of a normal, radians, over relative noise: the median over the mesh of how much normals differ from the mean of
/// those around them.
float noise_of_normals(const SurfaceMesh& mesh, const std::vector<Vertex>& vertices,
                       const std::vector<float>& relative) {
  NormalMeans means(vertices);
  for (const auto& triangle : mesh.triangles) {
    for (std::size_t k = 0; k < 3; ++k)
      means.add(static_cast<std::size_t>(triangle[k]), static_cast<std::size_t>(triangle[(k + 1) % 3]), 1);
  }
  std::vector<float> deviations;
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    const Simd4 sum = means.sum(i, 0);
    const float length = std::sqrt(squared_length(sum));
    if (relative[i] > 0 && length > 0)
      deviations.push_back(std::sqrt(squared_length(vertices[i].normal - sum / length)) / relative[i]);
  }
  constexpr float kOfMedian = 1.2011f;  // RMS of two components of equal noise over the median: 1 / √ln 2
  return kOfMedian * median(deviations);
}

}  // namespace

void filter_normals(const DistanceField& field, SurfaceMesh& mesh) {
  const std::vector<float> relative = relative_noise(field, mesh);
  std::vector<Vertex> vertices;
  vertices.reserve(mesh.normals.size());
  for (std::size_t i = 0; i < mesh.normals.size(); ++i)
    vertices.push_back({simd_of(mesh.vertices_m[i]), simd_of(mesh.normals[i])});
  // Relief is no noise.
  const float most_rad = kFilter.max_noise * static_cast<float>(kMinDepthSigma_m) / field.voxel_m,
              noise_rad = std::min(noise_of_normals(mesh, vertices, relative), most_rad);
  std::vector<int> passes;
  std::vector<float> variance;  // of differences that still count
  for (const float of_vertex : relative) {
    const float sigma_rad = noise_rad * of_vertex;
    passes.push_back(static_cast<int>(std::min(sigma_rad / kFilter.pass_rad, static_cast<float>(kFilter.max_passes))));
    variance.push_back(kFilter.range_sigmas * kFilter.range_sigmas * sigma_rad * sigma_rad);
  }
  std::vector<std::array<int, 3>> noisy = mesh.triangles;
  for (int pass = 0; pass < kFilter.max_passes; ++pass) {
    const auto is_noisy = [&](int corner) { return passes[static_cast<std::size_t>(corner)] > pass; };
    std::erase_if(noisy,
                  [&](const auto& triangle) { return std::none_of(triangle.begin(), triangle.end(), is_noisy); });
    if (noisy.empty()) break;
    NormalMeans means(vertices);
    const auto average = [&](int corner, int other) {
      const auto a = static_cast<std::size_t>(corner), b = static_cast<std::size_t>(other);
      // exp(-x) as (1 - x / 4)⁴.
      const float x = squared_length(vertices[a].normal - vertices[b].normal) / (variance[a] + variance[b]);
      if (!(x < 4)) return;
      const float root = (1 - x / 4) * (1 - x / 4);
      means.add(a, b, root * root / 2);  // an edge is of two triangles
    };
    for (const auto& [a, b, c] : noisy) {
      average(a, b);
      average(b, c);
      average(c, a);
    }
    for (std::size_t i = 0; i < vertices.size(); ++i) {
      if (passes[i] <= pass) continue;
      const Simd4 sum = means.sum(i, 1);
      const float length = std::sqrt(squared_length(sum));
      if (length > 0) vertices[i].normal = sum / length;
    }
  }
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    const Simd4& normal = vertices[i].normal;
    if (passes[i] > 0) mesh.normals[i] = {normal[0], normal[1], normal[2]};
  }
}

}  // namespace lumigraft::reconstruct
