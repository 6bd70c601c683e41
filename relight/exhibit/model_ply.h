#pragma once
// What assimp 5.2 doesn't tell about PLY files. Private to the model loader.
#include <filesystem>
#include <string>

namespace lumigraft::relight {

struct PlyFacts {
  bool colors_are_8_bit = false;  ///< such colours are sRGB in practice, those in floating point are linear
};

/// Throws InputError where the header has no end, for which assimp would wait for ever, and where an ASCII file has
/// fewer lines than its header says, in place of which assimp repeats the last one.
PlyFacts check_ply(const std::filesystem::path& file);

/// The file's bytes. Assimp skips white space behind the header of a binary file too, and a first number may begin with
/// a byte that looks like it: -0.04f does. That byte, the last of a little-endian mantissa, comes out one higher.
std::string read_ply(const std::filesystem::path& file);

}  // namespace lumigraft::relight
