#pragma once
// Textures of a glTF file: pictures, how they lie on surfaces, and what they show beyond their edges.
#include <map>
#include <optional>
#include <set>

#include "relight/exhibit/exhibit.h"
#include "relight/exhibit/gltf/buffers.h"

namespace lumigraft::relight {

class GltfTextures {
 public:
  GltfTextures(const GltfDocument& document, GltfBuffers& buffers) : document_(document), buffers_(buffers) {}

  /// Of a textureInfo. Without a picture if the value does not exist, or asks for what is not read here: a picture in
  /// another format than PNG, JPEG and WebP, or a texture coordinate set beyond the second. A picture that is used
  /// twice is decoded once. Throws InputError.
  Model::TextureSlot slot(const GltfValue& texture_info);
  /// The same, with alpha of the picture in all three channels; without a picture if it has none, which is 1.
  Model::TextureSlot slot_of_alpha(const GltfValue& texture_info);
  /// Alpha of the picture of a slot that has one; null: it is opaque. Throws InputError.
  std::shared_ptr<const capture::Image<std::uint8_t>> alpha(const GltfValue& texture_info);
  /// Texture coordinate set of a textureInfo.
  static std::size_t texcoord_set(const GltfValue& texture_info);
  /// The texture of a textureInfo that exists.
  GltfValue texture(const GltfValue& texture_info) const;
  /// Of those that were read, pictures that were larger than one may be (kGltf.max_texels), and are scaled down.
  std::size_t scaled_down() const { return scaled_down_.size(); }
  /// Texels that a picture may have.
  std::int64_t max_texels() const;
  /// Index of the image that is read of a texture; it does not exist if none can be.
  static GltfValue image_of(const GltfValue& texture);

 private:
  /// What `decode` makes of the bytes of an image.
  template <typename Decode>
  auto decoded(std::size_t image, Decode decode);
  TexturePicture picture(const GltfValue& reference);

  const GltfDocument& document_;
  GltfBuffers& buffers_;
  /// How a textureInfo lies, and the image that it shows, if that is read.
  std::optional<GltfValue> place(const GltfValue& texture_info, Model::TextureSlot* slot) const;

  std::map<std::size_t, TexturePicture> pictures_, alphas_;  // by index of the image
  std::set<std::size_t> scaled_down_;                        // likewise
};

}  // namespace lumigraft::relight
