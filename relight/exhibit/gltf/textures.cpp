#include "relight/exhibit/gltf/textures.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <string>
#include <vector>

#include "capture/error.h"
#include "relight/exhibit/gltf/parameters.h"
#include "relight/exhibit/gltf/uri.h"
#include "relight/exhibit/picture_decode.h"

namespace lumigraft::relight {
namespace {

constexpr std::size_t kMaxTexcoordSet = 1;

Wrap wrap_of(const GltfValue& sampler, const char* key) {
  switch (sampler.integer(key, 0, 65535, 10497)) {
    case 10497:
      return Wrap::repeat;
    case 33071:
      return Wrap::clamp_to_edge;
    case 33648:
      return Wrap::mirrored_repeat;
    default:
      sampler.member(key).refuse("10497 (repeat), 33071 (clamp to edge) or 33648 (mirrored repeat)");
  }
}

/// The rotation is from u towards -v: the GLSL in the extension's text turns the other way, but its example, its words
/// and the viewers do not (github.com/KhronosGroup/glTF/issues/1563).
Eigen::Matrix<float, 2, 3> texture_transform(const GltfValue& extension) {
  const double far = kGltf.max_texcoord;
  const std::vector<double> offset = extension.numbers("offset", 2, -far, far).value_or(std::vector<double>{0, 0}),
                            scale = extension.numbers("scale", 2, -far, far).value_or(std::vector<double>{1, 1});
  const double angle = extension.number("rotation", -far, far, 0), c = std::cos(angle), s = std::sin(angle);
  Eigen::Matrix<double, 2, 3> transform;
  transform << c * scale[0], s * scale[1], offset[0],  //
      -s * scale[0], c * scale[1], offset[1];
  return transform.cast<float>();
}

/// As image.mimeType must say where it says anything.
void check_format(const GltfValue& image, std::span<const std::uint8_t> bytes) {
  const auto header = picture_header(bytes);
  if (!header) image.fail("found another format or a broken picture, allowed: PNG, JPEG or WebP");
  const std::string mime = image.text("mimeType", std::string(header->mime));
  if (mime != header->mime) {
    image.member("mimeType").refuse("\"" + std::string(header->mime) + "\", as the picture's data are");
  }
}

}  // namespace

std::size_t GltfTextures::texcoord_set(const GltfValue& texture_info) {
  const std::size_t own = texture_info.integer("texCoord", 0, 255, 0);
  return texture_info.extension("KHR_texture_transform").integer("texCoord", 0, 255, own);
}

GltfValue GltfTextures::texture(const GltfValue& texture_info) const {
  const GltfValue textures = document_.root().member("textures");
  return textures[texture_info.member("index").index(textures.size(), "textures")];
}

GltfValue GltfTextures::image_of(const GltfValue& texture) {
  const GltfValue webp = texture.extension("EXT_texture_webp").member("source");
  return webp.exists() ? webp : texture.member("source");
}

std::optional<GltfValue> GltfTextures::place(const GltfValue& texture_info, Model::TextureSlot* slot) const {
  if (!texture_info.exists()) return std::nullopt;
  const GltfValue texture = this->texture(texture_info), image = image_of(texture);
  const std::size_t set = texcoord_set(texture_info);
  if (!image.exists() || set > kMaxTexcoordSet) return std::nullopt;
  slot->texcoord_set = static_cast<unsigned>(set);
  slot->transform = texture_transform(texture_info.extension("KHR_texture_transform"));
  if (const GltfValue reference = texture.member("sampler"); reference.exists()) {
    const GltfValue samplers = document_.root().member("samplers");
    const GltfValue sampler = samplers[reference.index(samplers.size(), "samplers")];
    slot->wrap_u = wrap_of(sampler, "wrapS");
    slot->wrap_v = wrap_of(sampler, "wrapT");
  }
  return image;
}

Model::TextureSlot GltfTextures::slot(const GltfValue& texture_info) {
  Model::TextureSlot slot;
  if (const auto image = place(texture_info, &slot)) slot.picture = picture(*image);
  return slot;
}

Model::TextureSlot GltfTextures::slot_of_alpha(const GltfValue& texture_info) {
  Model::TextureSlot slot;
  const auto image = place(texture_info, &slot);
  if (!image) return slot;
  const auto [found, is_new] = alphas_.try_emplace(image->index(document_.root().member("images").size(), "images"));
  if (is_new) {
    if (const auto alpha = this->alpha(texture_info)) {
      auto grey = std::make_shared<capture::Image<std::uint8_t>>(alpha->width, alpha->height, 3);
      for (std::size_t i = 0; i < grey->data.size(); ++i) grey->data[i] = alpha->data[i / 3];
      found->second = std::move(grey);
    }
  }
  slot.picture = found->second;
  return slot;
}

std::int64_t GltfTextures::max_texels() const {
  const std::size_t images = std::max(document_.root().member("images").size(), std::size_t{1});
  return static_cast<std::int64_t>(std::max(kGltf.max_texels / images, std::size_t{1}));
}

template <typename Decode>
auto GltfTextures::decoded(std::size_t index, Decode decode) {
  const GltfValue image = document_.root().member("images")[index];
  const GltfValue uri = image.member("uri");
  std::vector<std::uint8_t> content;
  std::span<const std::uint8_t> bytes;
  if (uri.exists()) {
    content = read_uri(uri, document_.file().parent_path(), kGltf.max_picture_bytes);
    bytes = content;
  } else {
    bytes = buffers_.view(image.member("bufferView")).bytes;
  }
  check_format(image, bytes);
  const auto header = picture_header(bytes);
  if (halvings(header->width, header->height, max_texels()) > 0) scaled_down_.insert(index);
  try {
    return decode(bytes, max_texels());
  } catch (const capture::InputError& error) {
    image.fail(error.what());
  }
}

TexturePicture GltfTextures::picture(const GltfValue& reference) {
  const GltfValue images = document_.root().member("images");
  const std::size_t index = reference.index(images.size(), "images");
  TexturePicture& picture = pictures_[index];
  if (!picture) picture = decoded(index, decode_picture);
  return picture;
}

std::shared_ptr<const capture::Image<std::uint8_t>> GltfTextures::alpha(const GltfValue& texture_info) {
  const GltfValue images = document_.root().member("images"), reference = image_of(texture(texture_info));
  return decoded(reference.index(images.size(), "images"), decode_alpha);
}

}  // namespace lumigraft::relight
