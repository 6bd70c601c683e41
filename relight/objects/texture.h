#pragma once
// A texture, read bilinearly, with mip levels.
#include <Eigen/Core>
#include <array>
#include <vector>

#include "relight/exhibit/exhibit.h"

namespace lumigraft::relight {

/// What the bytes of a texture mean.
enum class Texels {
  srgb,     ///< colours, to be linear
  linear,   ///< 0 to 1
  normals,  ///< unit vectors, each component from -1 to 1
};

/// The textures of a part.
enum class TextureUse {
  base_color,
  metallic_roughness,
  normals,
  emission,
  transmission,
  clearcoat,
  clearcoat_roughness,
  clearcoat_normals,
  specular,
  specular_color,
  sheen_color,
  sheen_roughness,
  anisotropy,
  opacity
};
constexpr std::array kTextureUses = {TextureUse::base_color,
                                     TextureUse::metallic_roughness,
                                     TextureUse::normals,
                                     TextureUse::emission,
                                     TextureUse::transmission,
                                     TextureUse::clearcoat,
                                     TextureUse::clearcoat_roughness,
                                     TextureUse::clearcoat_normals,
                                     TextureUse::specular,
                                     TextureUse::specular_color,
                                     TextureUse::sheen_color,
                                     TextureUse::sheen_roughness,
                                     TextureUse::anisotropy,
                                     TextureUse::opacity};
/// The first ones, which devices draw at their texel; of the others they have the mean.
constexpr std::size_t kDeviceTextureUses = 7;
Texels texels_of(TextureUse use);
const Model::TextureSlot& slot_of(const Model::Part& part, TextureUse use);
inline bool has_picture(const Model::TextureSlot& slot) { return slot.picture && !slot.picture->empty(); }

template <typename T>
using PerTextureUse = std::array<T, kTextureUses.size()>;

class Texture {
 public:
  /// Of a picture that is not null. Without mip levels every footprint is taken for a point.
  Texture(TexturePicture picture, Texels texels, bool mips);

  const capture::Image<std::uint8_t>& picture() const { return *picture_; }
  /// Decoded; the first has half the picture's size, the last one texel.
  const std::vector<capture::Image<float>>& mips() const { return mips_; }
  /// Number of texels of the picture in a unit square of texture coordinates.
  float texels() const { return static_cast<float>(picture_->width) * static_cast<float>(picture_->height); }

  /// The mean over a square footprint that is so many texels of the picture wide. Texel centres are at
  /// (x + 1/2) / width. Linear between the two mip levels that are nearest. The mean of normals is shorter than 1 by
  /// what they differ within the footprint.
  Eigen::Vector3f at(const Eigen::Vector2f& uv, float texels_across, Wrap wrap_u = Wrap::repeat,
                     Wrap wrap_v = Wrap::repeat) const;
  /// The mean over a parallelogram around `uv`, whose edges are the columns, in texture coordinates. Of colours that
  /// differ there, by taps at most a texel apart, in the coarsest level of which a texel is a small part of the
  /// parallelogram's width; else over a square of the same area.
  Eigen::Vector3f mean(const Eigen::Vector2f& uv, const Eigen::Matrix2f& edges, Wrap wrap_u = Wrap::repeat,
                       Wrap wrap_v = Wrap::repeat) const;

 private:
  /// Whether colours differ noticeably within so many texels of the picture around `uv`.
  bool differ(const Eigen::Vector2f& uv, float texels_across, Wrap wrap_u, Wrap wrap_v) const;
  Eigen::Vector3f level(std::size_t number, const Eigen::Vector2f& uv, Wrap wrap_u, Wrap wrap_v) const;

  TexturePicture picture_;
  Texels texels_;
  std::vector<capture::Image<float>> mips_;
  std::vector<capture::Image<std::uint8_t>>
      extremes_;  ///< of colours, by mip: least, then largest byte of each channel
};

}  // namespace lumigraft::relight
