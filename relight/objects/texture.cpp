#include "relight/objects/texture.h"

#include <algorithm>
#include <cmath>

#include "capture/camera/srgb.h"
#include "relight/exhibit/texture_wrap.h"
#include "relight/objects/parameters.h"

namespace lumigraft::relight {
namespace {

using Eigen::Vector3f;

/// Of a picture's texel.
struct Decode {
  Texels texels;
  Vector3f operator()(const capture::Image<std::uint8_t>& picture, int u, int v) const {
    const std::uint8_t *c = &picture.at(u, v, 0), r = c[0], g = c[1], b = c[2];
    if (texels == Texels::srgb) {
      const auto& linear = capture::srgb_table().linear;
      return {linear[r], linear[g], linear[b]};
    }
    const Vector3f unorm = Vector3f(r, g, b) / 255;
    if (texels == Texels::linear) return unorm;
    return (2 * unorm - Vector3f::Ones()).stableNormalized();
  }
  Vector3f operator()(const capture::Image<float>& mip, int u, int v) const {
    return Eigen::Map<const Vector3f>(&mip.at(u, v, 0));
  }
};

/// Half the size: each texel is the mean of the two or, at odd sizes, up to three rows and columns that it covers.
template <typename T>
capture::Image<float> halved(const capture::Image<T>& from, Decode decode) {
  capture::Image<float> to(std::max(1, from.width / 2), std::max(1, from.height / 2), 3);
  for (int y = 0; y < to.height; ++y) {
    const int y0 = y * from.height / to.height, y1 = (y + 1) * from.height / to.height;
    for (int x = 0; x < to.width; ++x) {
      const int x0 = x * from.width / to.width, x1 = (x + 1) * from.width / to.width;
      Vector3f sum = Vector3f::Zero();
      for (int v = y0; v < y1; ++v) {
        for (int u = x0; u < x1; ++u) sum += decode(from, u, v);
      }
      Eigen::Map<Vector3f>(&to.at(x, y, 0)) = sum / static_cast<float>((y1 - y0) * (x1 - x0));
    }
  }
  return to;
}

template <typename T>
Vector3f bilinear(const capture::Image<T>& image, const Eigen::Vector2f& uv, Wrap wrap_u, Wrap wrap_v, Decode decode) {
  const TexelNeighbours x = texel_neighbours(uv.x(), image.width, wrap_u),
                        y = texel_neighbours(uv.y(), image.height, wrap_v);
  const auto row = [&](int v) -> Vector3f {
    const Vector3f left = decode(image, x.texel[0], v), right = decode(image, x.texel[1], v);
    return left + x.weight * (right - left);
  };
  const Vector3f above = row(y.texel[0]), below = row(y.texel[1]);
  return above + y.weight * (below - above);
}

}  // namespace

Texels texels_of(TextureUse use) {
  switch (use) {
    case TextureUse::metallic_roughness:
    case TextureUse::transmission:
    case TextureUse::clearcoat:
    case TextureUse::clearcoat_roughness:
    case TextureUse::specular:
    case TextureUse::sheen_roughness:
    case TextureUse::anisotropy:
      return Texels::linear;
    case TextureUse::normals:
    case TextureUse::clearcoat_normals:
      return Texels::normals;
    case TextureUse::base_color:
    case TextureUse::emission:
    case TextureUse::specular_color:
    case TextureUse::sheen_color:
      break;
  }
  return Texels::srgb;
}

const Model::TextureSlot& slot_of(const Model::Part& part, TextureUse use) {
  switch (use) {
    case TextureUse::metallic_roughness:
      return part.metallic_roughness_texture;
    case TextureUse::normals:
      return part.normal_texture;
    case TextureUse::emission:
      return part.emissive_texture;
    case TextureUse::transmission:
      return part.transmission_texture;
    case TextureUse::clearcoat:
      return part.clearcoat_texture;
    case TextureUse::clearcoat_roughness:
      return part.clearcoat_roughness_texture;
    case TextureUse::clearcoat_normals:
      return part.clearcoat_normal_texture;
    case TextureUse::specular:
      return part.specular_texture;
    case TextureUse::specular_color:
      return part.specular_color_texture;
    case TextureUse::sheen_color:
      return part.sheen_color_texture;
    case TextureUse::sheen_roughness:
      return part.sheen_roughness_texture;
    case TextureUse::anisotropy:
      return part.anisotropy_texture;
    case TextureUse::base_color:
      break;
  }
  return part.base_color_texture;
}

Texture::Texture(TexturePicture picture, Texels texels, bool mips) : picture_(std::move(picture)), texels_(texels) {
  if (!mips) return;
  if (picture_->width > 1 || picture_->height > 1) mips_.push_back(halved(*picture_, {texels_}));
  while (!mips_.empty() && (mips_.back().width > 1 || mips_.back().height > 1)) {
    mips_.push_back(halved(mips_.back(), {texels_}));
  }
}

Vector3f Texture::level(std::size_t number, const Eigen::Vector2f& uv, Wrap wrap_u, Wrap wrap_v) const {
  if (number > 0) return bilinear(mips_[number - 1], uv, wrap_u, wrap_v, {texels_});
  const Vector3f value = bilinear(*picture_, uv, wrap_u, wrap_v, {texels_});
  return texels_ == Texels::normals ? Vector3f(value.stableNormalized()) : value;
}

Vector3f Texture::at(const Eigen::Vector2f& uv, float texels_across, Wrap wrap_u, Wrap wrap_v) const {
  // The tent of bilinear interpolation adds twice the variance of a texel's square.
  const float square_over_tent = std::sqrt(3.0f);
  const float wanted = std::log2(std::max(1.0f, texels_across / square_over_tent));  // 0 of NaN
  const float level_from_0 = std::min(wanted, static_cast<float>(mips_.size()));
  const auto finer = static_cast<std::size_t>(level_from_0);
  const float coarser_weight = level_from_0 - static_cast<float>(finer);
  const Vector3f fine = level(finer, uv, wrap_u, wrap_v);
  return coarser_weight > 0 ? Vector3f(fine + coarser_weight * (level(finer + 1, uv, wrap_u, wrap_v) - fine)) : fine;
}

Vector3f Texture::mean(const Eigen::Vector2f& uv, const Eigen::Matrix2f& edges, Wrap wrap_u, Wrap wrap_v) const {
  const Eigen::Matrix2f texels = Eigen::Vector2f(picture_->width, picture_->height).asDiagonal() * edges;
  if (!texels.allFinite()) return at(uv, 1, wrap_u, wrap_v);
  const float longest = std::max(texels.col(0).norm(), texels.col(1).norm()),
              width = std::abs(texels.determinant()) / std::max(longest, 1e-30f);
  const float wanted = std::log2(std::max({1.0f, width / kObjects.texels_of_width, longest / kObjects.texels_of_length}));
  const std::size_t level_of_mean = std::min(static_cast<std::size_t>(wanted), mips_.size());
  const float taps_per_texel = std::ldexp(kObjects.taps_per_texel, -static_cast<int>(level_of_mean));
  const auto taps_along = [&](int axis) {
    const float wanted_taps = std::ceil(taps_per_texel * texels.col(axis).norm());
    return static_cast<int>(std::clamp(wanted_taps, 1.0f, kObjects.taps_per_texel * kObjects.texels_of_length));
  };
  const int first = taps_along(0), second = taps_along(1);
  Vector3f sum = Vector3f::Zero();
  for (int j = 0; j < second; ++j) {
    const float y = (static_cast<float>(j) + 0.5f) / static_cast<float>(second) - 0.5f;
    for (int i = 0; i < first; ++i) {
      const float x = (static_cast<float>(i) + 0.5f) / static_cast<float>(first) - 0.5f;
      sum += level(level_of_mean, uv + edges * Eigen::Vector2f(x, y), wrap_u, wrap_v);
    }
  }
  return sum / static_cast<float>(first * second);
}

}  // namespace lumigraft::relight
