#pragma once
// Checks of PLY files that assimp 5.2 lacks. Private to the model loader.
#include <filesystem>
#include <string>

namespace lumigraft::relight {

struct PlyFacts {
  bool colors_are_8_bit = false;  ///< 8-bit colours are sRGB in practice, floating point colours linear
};

/// Throws InputError if the header has no end (assimp would not terminate) or an ASCII file has fewer lines than its
/// header states (assimp would repeat the last one).
PlyFacts check_ply(const std::filesystem::path& file);

/// The file's bytes, changed where assimp would misread them: it skips white space after the header of a binary file
/// too, and a first number may begin with such a byte, as -0.04f does. That byte, the lowest of a little-endian
/// mantissa, is increased by one.
std::string read_ply(const std::filesystem::path& file);

}  // namespace lumigraft::relight
