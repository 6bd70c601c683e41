#include "relight/objects/texture.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "capture/camera/srgb.h"
#include "relight/exhibit/texture_wrap.h"
#include "relight/objects/parameters.h"

namespace lumigraft::relight {
namespace {

using Eigen::Vector3f;

// What texels mean. These are called for every texel: which it is, is decided once for many of them (`decoded`).
struct DecodeSrgb {
  const float* linear = capture::srgb_table().linear.data();
  Vector3f operator()(const capture::Image<std::uint8_t>& picture, int u, int v) const {
    const std::uint8_t* c = &picture.at(u, v, 0);
    return {linear[c[0]], linear[c[1]], linear[c[2]]};
  }
};
struct DecodeLinear {
  Vector3f operator()(const capture::Image<std::uint8_t>& picture, int u, int v) const {
    const std::uint8_t* c = &picture.at(u, v, 0);
    return Vector3f(c[0], c[1], c[2]) / 255;
  }
};
struct DecodeNormal {
  Vector3f operator()(const capture::Image<std::uint8_t>& picture, int u, int v) const {
    return (2 * DecodeLinear()(picture, u, v) - Vector3f::Ones()).stableNormalized();
  }
};
struct DecodeMip {
  Vector3f operator()(const capture::Image<float>& mip, int u, int v) const {
    return Eigen::Map<const Vector3f>(&mip.at(u, v, 0));
  }
};

/// `use(decode)` with what decodes a picture's texels.
template <typename Use>
auto decoded(Texels texels, Use use) {
  switch (texels) {
    case Texels::linear:
      return use(DecodeLinear());
    case Texels::normals:
      return use(DecodeNormal());
    case Texels::srgb:
      break;
  }
  return use(DecodeSrgb());
}

/// Half the size: each texel is the mean of the two or, at odd sizes, up to three rows and columns that it covers.
template <typename T, typename Decode>
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

/// As `halved`: least and largest byte of each channel, rgb and rgb, of a picture or of such extremes.
capture::Image<std::uint8_t> extremes_of_halved(const capture::Image<std::uint8_t>& from) {
  capture::Image<std::uint8_t> to(std::max(1, from.width / 2), std::max(1, from.height / 2), 6);
  const int largest = from.channels - 3;  // the channel from which these begin
  for (int y = 0; y < to.height; ++y) {
    const int y0 = y * from.height / to.height, y1 = (y + 1) * from.height / to.height;
    for (int x = 0; x < to.width; ++x) {
      const int x0 = x * from.width / to.width, x1 = (x + 1) * from.width / to.width;
      for (int c = 0; c < 3; ++c) {
        std::uint8_t low = 255, high = 0;
        for (int v = y0; v < y1; ++v) {
          for (int u = x0; u < x1; ++u) {
            low = std::min(low, from.at(u, v, c));
            high = std::max(high, from.at(u, v, largest + c));
          }
        }
        to.at(x, y, c) = low;
        to.at(x, y, 3 + c) = high;
      }
    }
  }
  return to;
}

template <typename T, typename Decode>
Vector3f bilinear(const capture::Image<T>& image, const Eigen::Vector2f& uv, Wrap wrap_u, Wrap wrap_v, Decode decode) {
  const TexelNeighbours x = texel_neighbours(uv.x(), image.width, wrap_u),
                        y = texel_neighbours(uv.y(), image.height, wrap_v);
  const float right = x.weight, left = 1 - right, lower = y.weight, upper = 1 - lower;
  return upper * left * decode(image, x.texel[0], y.texel[0]) + upper * right * decode(image, x.texel[1], y.texel[0]) +
         lower * left * decode(image, x.texel[0], y.texel[1]) + lower * right * decode(image, x.texel[1], y.texel[1]);
}

/// A lattice of taps, in texels of a level: the first row and column, and the steps along rows and between them.
struct Taps {
  Eigen::Vector2f first, along, across;
  int columns, rows;

  Eigen::Vector2f last() const {
    return first + static_cast<float>(columns - 1) * along + static_cast<float>(rows - 1) * across;
  }
};

/// Texels of an axis that taps read.
struct TexelSpan {
  int first = 0, count = 0;

  TexelSpan(const Taps& taps, int axis) {
    // The corners of the lattice; texel centres are at n + 1/2.
    const float a = taps.first[axis], d = taps.last()[axis],
                b = a + static_cast<float>(taps.columns - 1) * taps.along[axis], c = a + d - b;
    const float low = std::floor(std::min({a, b, c, d}) - 0.5f), high = std::floor(std::max({a, b, c, d}) - 0.5f);
    if (!(std::abs(low) < kObjects.far_texels && high - low < kObjects.max_tap_span)) return;  // not NaN either
    first = static_cast<int>(low) - 1;  // one to each side for rounding
    count = static_cast<int>(high) + 3 - first;
  }
  bool known() const { return count > 0; }
};

int wrapped(int texel, int size, Wrap wrap) {
  if (texel >= 0 && texel < size) return texel;
  if (wrap == Wrap::clamp_to_edge) return std::clamp(texel, 0, size - 1);
  const int period = wrap == Wrap::repeat ? size : 2 * size, within = (texel % period + period) % period;
  return within < size ? within : period - 1 - within;
}

/// The sum of bilinear taps: each texel is read once, times what all taps give it; nothing if they spread over more
/// texels than are worth that.
template <typename T, typename Decode>
std::optional<Vector3f> sum_of(const capture::Image<T>& image, const Taps& taps, Wrap wrap_u, Wrap wrap_v,
                               Decode decode) {
  const TexelSpan u(taps, 0), v(taps, 1);
  if (!u.known() || !v.known() || u.count * v.count > 8 * taps.columns * taps.rows + 32) return std::nullopt;
  constexpr std::size_t kMost = static_cast<std::size_t>(kObjects.max_tap_span) + 4;
  std::array<float, kMost * kMost> weights;
  std::fill_n(weights.begin(), u.count * v.count, 0.0f);
  for (int j = 0; j < taps.rows; ++j) {
    const Eigen::Vector2f row = taps.first + static_cast<float>(j) * taps.across;
    for (int i = 0; i < taps.columns; ++i) {
      const float x = row.x() + static_cast<float>(i) * taps.along.x() - 0.5f - static_cast<float>(u.first),
                  y = row.y() + static_cast<float>(i) * taps.along.y() - 0.5f - static_cast<float>(v.first);
      const int left = static_cast<int>(x), top = static_cast<int>(y);  // positive
      const float right = x - static_cast<float>(left), bottom = y - static_cast<float>(top);
      float* at = &weights[static_cast<std::size_t>(top * u.count + left)];
      at[0] += (1 - right) * (1 - bottom);
      at[1] += right * (1 - bottom);
      at[u.count] += (1 - right) * bottom;
      at[u.count + 1] += right * bottom;
    }
  }
  std::array<int, kMost> columns;
  for (int i = 0; i < u.count; ++i) columns[static_cast<std::size_t>(i)] = wrapped(u.first + i, image.width, wrap_u);
  Vector3f sum = Vector3f::Zero();
  for (int j = 0; j < v.count; ++j) {
    const int y = wrapped(v.first + j, image.height, wrap_v);
    const float* of_row = &weights[static_cast<std::size_t>(j * u.count)];
    for (int i = 0; i < u.count; ++i) {
      if (of_row[i] > 0) sum += of_row[i] * decode(image, columns[static_cast<std::size_t>(i)], y);
    }
  }
  return sum;
}

/// The coordinate brought near 0 to 1.
float in_period(float coordinate, Wrap wrap) {
  if (wrap == Wrap::repeat) return coordinate - std::floor(coordinate);
  return wrap == Wrap::mirrored_repeat ? coordinate - 2 * std::floor(coordinate / 2) : coordinate;
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
    case TextureUse::opacity:
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
    case TextureUse::opacity:
      return part.opacity_texture;
    case TextureUse::anisotropy:
      return part.anisotropy_texture;
    case TextureUse::base_color:
      break;
  }
  return part.base_color_texture;
}

Texture::Texture(TexturePicture picture, Texels texels, bool mips) : picture_(std::move(picture)), texels_(texels) {
  if (!mips) return;
  if (picture_->width > 1 || picture_->height > 1)
    mips_.push_back(decoded(texels_, [&](const auto& decode) { return halved(*picture_, decode); }));
  while (!mips_.empty() && (mips_.back().width > 1 || mips_.back().height > 1)) {
    mips_.push_back(halved(mips_.back(), DecodeMip()));
  }
  if (texels_ != Texels::srgb || mips_.empty()) return;
  extremes_.push_back(extremes_of_halved(*picture_));
  while (extremes_.size() < mips_.size()) extremes_.push_back(extremes_of_halved(extremes_.back()));
}

Vector3f Texture::level(std::size_t number, const Eigen::Vector2f& uv, Wrap wrap_u, Wrap wrap_v) const {
  if (number > 0) return bilinear(mips_[number - 1], uv, wrap_u, wrap_v, DecodeMip());
  const Vector3f value =
      decoded(texels_, [&](const auto& decode) { return bilinear(*picture_, uv, wrap_u, wrap_v, decode); });
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

bool Texture::differ(const Eigen::Vector2f& uv, float texels_across, Wrap wrap_u, Wrap wrap_v) const {
  if (extremes_.empty()) return false;
  // Two by two texels of a level reach half a texel at least to all sides; bilinear taps reach one of the picture
  // further.
  const float wanted = std::ceil(std::log2(std::max(texels_across + 2, 2.0f)));
  const auto number = std::min(static_cast<std::size_t>(wanted), extremes_.size()) - 1;
  const capture::Image<std::uint8_t>& extremes = extremes_[number];
  const TexelNeighbours x = texel_neighbours(uv.x(), extremes.width, wrap_u),
                        y = texel_neighbours(uv.y(), extremes.height, wrap_v);
  for (int c = 0; c < 3; ++c) {
    int least = 255, largest = 0;
    for (const int v : y.texel) {
      for (const int u : x.texel) {
        least = std::min<int>(least, extremes.at(u, v, c));
        largest = std::max<int>(largest, extremes.at(u, v, 3 + c));
      }
    }
    if (largest - least > kObjects.even_range) return true;
  }
  return false;
}

Vector3f Texture::mean(const Eigen::Vector2f& uv, const Eigen::Matrix2f& edges, Wrap wrap_u, Wrap wrap_v) const {
  const Eigen::Matrix2f texels = Eigen::Vector2f(picture_->width, picture_->height).asDiagonal() * edges;
  if (!texels.allFinite()) return at(uv, 1, wrap_u, wrap_v);
  if (!differ(uv, texels.cwiseAbs().rowwise().sum().maxCoeff(), wrap_u, wrap_v))
    return at(uv, std::sqrt(std::abs(texels.determinant())), wrap_u, wrap_v);
  const int along = texels.col(0).squaredNorm() >= texels.col(1).squaredNorm() ? 0 : 1;
  const float longer = texels.col(along).norm(), shorter = texels.col(1 - along).norm(),
              width = std::abs(texels.determinant()) / std::max(longer, 1e-30f);
  const float wanted =
      std::log2(std::max({1.0f, width / kObjects.texels_of_width, longer / kObjects.texels_of_length}));
  const std::size_t number = std::min(static_cast<std::size_t>(wanted), mips_.size());
  // In a coarser level, whose texels are narrow, one tap per texel: the tents of neighbours add up to an even weight.
  // Rows of taps along the longer edge: of edges that are nearly parallel a few rows are enough.
  const float most = kObjects.taps_per_texel * kObjects.texels_of_length,
              per_texel = number > 0 ? std::ldexp(1.0f, -static_cast<int>(number)) : kObjects.taps_per_texel,
              most_rows = std::clamp(per_texel * width, kObjects.taps_per_texel * kObjects.texels_of_width, most);
  const auto taps = [](float at_least, float at_most) {
    return static_cast<int>(std::ceil(std::clamp(at_least, 1.0f, at_most)));
  };
  const int columns = taps(per_texel * longer, most), rows = taps(per_texel * shorter, most_rows);
  const Eigen::Vector2f size = number > 0 ? Eigen::Vector2f(mips_[number - 1].width, mips_[number - 1].height)
                                          : Eigen::Vector2f(picture_->width, picture_->height);
  const Eigen::Vector2f step_x = edges.col(along).cwiseProduct(size) / static_cast<float>(columns),
                        step_y = edges.col(1 - along).cwiseProduct(size) / static_cast<float>(rows),
                        middle = Eigen::Vector2f(in_period(uv.x(), wrap_u), in_period(uv.y(), wrap_v));
  const Taps lattice{middle.cwiseProduct(size) - static_cast<float>(columns - 1) / 2 * step_x -
                         static_cast<float>(rows - 1) / 2 * step_y,
                     step_x, step_y, columns, rows};
  const auto at_once =
      number > 0
          ? sum_of(mips_[number - 1], lattice, wrap_u, wrap_v, DecodeMip())
          : decoded(texels_, [&](const auto& decode) { return sum_of(*picture_, lattice, wrap_u, wrap_v, decode); });
  if (at_once) return *at_once / static_cast<float>(columns * rows);
  Vector3f sum = Vector3f::Zero();
  for (int j = 0; j < rows; ++j) {
    const float y = (static_cast<float>(j) + 0.5f) / static_cast<float>(rows) - 0.5f;
    for (int i = 0; i < columns; ++i) {
      const float x = (static_cast<float>(i) + 0.5f) / static_cast<float>(columns) - 0.5f;
      sum += level(number, uv + x * edges.col(along) + y * edges.col(1 - along), wrap_u, wrap_v);
    }
  }
  return sum / static_cast<float>(columns * rows);
}

}  // namespace lumigraft::relight
