#pragma once
// Limits of what is read of glTF files: what a small, broken file can ask for stays bounded.
#include <cstddef>
#include <limits>

namespace lumigraft::relight {

inline constexpr double kAnyNumber = std::numeric_limits<double>::max();

struct GltfParameters {
  std::size_t max_file_bytes = std::size_t{1} << 31;  ///< of the file, and of all of its buffers together
  std::size_t max_elements =
      50'000'000;  ///< of all accessors that are read, and vertices of all instances and variants: a second or two
  std::size_t max_picture_bytes = std::size_t{1} << 28;  ///< of a picture in a file of its own
  /// Of all pictures of a file together, each of which may have an equal part of it. With mip levels they take 0.5 GB
  /// of memory for rays, 0.6 GB for devices and 0.4 GB of theirs.
  std::size_t max_texels = std::size_t{1} << 26;
  std::size_t max_zeros = 1'000'000;        ///< elements of an accessor that no data follow
  std::size_t max_nodes = 100'000;          ///< those of large scenes have some thousands
  std::size_t max_triangles = 5'000'000;    ///< of all instances and variants: 1 GB while it is read
  std::size_t max_variants = 100;           ///< those of shops have some
  std::size_t max_expansion = 128;          ///< of EXT_meshopt_compression; the codec's own limit is 64
  std::size_t max_morph_weights = 100'000;  ///< of all nodes: one of each is in every pose
  std::size_t max_morphs = 10'000'000;      ///< vertices that morph targets move: 400 MB
  double max_time_s = 1e6;                  ///< of keys: floats are a sixteenth of a second apart there
  double max_length = 1e9;                  ///< of coordinates of nodes, and of what moves them
  double max_texcoord = 1e6;                ///< of texture transforms: beyond it floats resolve no texel
  float max_normal_scale = 100;             ///< beyond it any normal that is not upright lies flat
};
inline constexpr GltfParameters kGltf;

}  // namespace lumigraft::relight
