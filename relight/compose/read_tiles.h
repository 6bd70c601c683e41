#pragma once
// Reads back what the device rendered in blocks of kTile_px.
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "relight/compose/object_layer.h"
#include "relight/passes/screen/screen.h"

namespace lumigraft::relight {

/// Pixel bounds of a block, given as column | row << 16.
inline int left_of(std::uint32_t place) { return kTile_px * static_cast<int>(place & 0xffff); }
inline int top_of(std::uint32_t place) { return kTile_px * static_cast<int>(place >> 16); }

/// Blocks of the picture to read from a texture of four channels, halves or floats, or of one float, that has one texel
/// per `step` pixels along each axis. The texture and the list must live as long as the TileReader.
struct WantedTiles {
  const gpu::Texture& texture;
  const std::vector<std::uint32_t>& places;
  int step = 1;
};

/// The parts of textures around some blocks, downloaded in one transfer.
class TileReader {
 public:
  TileReader(gpu::Device& device, std::span<const WantedTiles> wanted);
  /// Channels `first` to `first + channels` of the blocks wanted[number]; `out`: of the texture's size; its other
  /// texels are kept.
  void read(std::size_t number, int first, int channels, std::vector<float>* out) const;

 private:
  struct Part {
    WantedTiles wanted;
    gpu::Area area;  ///< around the blocks, in texels; empty if there are none
    std::vector<std::byte> texels;
  };
  std::vector<Part> parts_;
};

/// object_layer and object_z in these blocks.
std::array<WantedTiles, 2> object_tiles(const Screen& screen, const std::vector<std::uint32_t>& places);
/// From a reader of which object_tiles() are wanted[number] and the next; other blocks of `objects`, which is of the
/// picture's size, are kept. `rays`: x/z and y/z per pixel.
void read_objects(const TileReader& reader, std::size_t number, const Screen& screen, const std::vector<float>& rays,
                  const std::vector<std::uint32_t>& places, ObjectLayer* objects);
/// Removes the objects of a block.
void clear_objects(std::uint32_t place, ObjectLayer* objects);

}  // namespace lumigraft::relight
