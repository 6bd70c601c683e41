#pragma once
// What assimp 5.2 doesn't tell about PLY files. Private to the model loader.
#include <filesystem>

namespace lumigraft {

struct PlyFacts {
  bool colors_are_8_bit = false;  ///< such colours are sRGB in practice, those in floating point are linear
};

/// Throws InputError where the header has no end, for which assimp would wait for ever, and where an ASCII file has
/// fewer lines than its header says, in place of which assimp repeats the last one.
PlyFacts check_ply(const std::filesystem::path& file);

}  // namespace lumigraft
