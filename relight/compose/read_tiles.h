#pragma once
// Reads back what the device rendered in blocks of kTile_px.
#include <cstdint>
#include <vector>

#include "relight/compose/object_layer.h"
#include "relight/passes/screen/screen.h"

namespace lumigraft::relight {

/// Pixel bounds of a block, given as column | row << 16.
inline int left_of(std::uint32_t place) { return kTile_px * static_cast<int>(place & 0xffff); }
inline int top_of(std::uint32_t place) { return kTile_px * static_cast<int>(place >> 16); }

/// A texture of four channels, halves or floats, or of one float, downloaded once.
class TileReader {
 public:
  TileReader(gpu::Device& device, const gpu::Texture& texture);
  /// Channels `first` to `first + channels` in these blocks of the picture, of which the texture has one of `step`
  /// pixels along each axis; `out`: of the texture's size.
  void read(const std::vector<std::uint32_t>& places, int step, int first, int channels, std::vector<float>* out) const;

 private:
  gpu::TextureDesc desc_;
  std::vector<std::byte> texels_;
};

/// Reads object_layer and object_z; other blocks of `objects`, which is of the picture's size, are kept. `rays`: x/z
/// and y/z per pixel.
void read_objects(gpu::Device& device, const Screen& screen, const std::vector<float>& rays,
                  const std::vector<std::uint32_t>& places, ObjectLayer* objects);
/// Removes the objects of a block.
void clear_objects(std::uint32_t place, ObjectLayer* objects);

}  // namespace lumigraft::relight
