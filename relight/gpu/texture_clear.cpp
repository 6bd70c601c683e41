#include "relight/gpu/texture_clear.h"

#include "relight/gpu/formats.h"

namespace lumigraft::relight::gpu {

TextureClear::TextureClear(Device& device)
    : half_picture_(device.create_compute("clear_half_picture.comp")),
      float_picture_(device.create_compute("clear_float_picture.comp")),
      half_volume_(device.create_compute("clear_half_volume.comp")),
      float_volume_(device.create_compute("clear_float_volume.comp")) {}

bool TextureClear::record(CommandList& list, const Texture& texture, const std::array<float, 4>& value) const {
  const TextureDesc& desc = texture.desc();
  const bool halves = desc.format == Format::rgba16_float, floats = desc.format == Format::rgba32_float;
  if (desc.mips > 1 || !(halves || floats) || value != std::array<float, 4>{}) return false;
  const Binding target[] = {image(1, texture)};
  if (is_volume(desc)) {
    list.dispatch(halves ? *half_volume_ : *float_volume_, target, {}, (desc.width + 7) / 8, (desc.height + 3) / 4,
                  (desc.depth + 1) / 2);
  } else {
    list.dispatch(halves ? *half_picture_ : *float_picture_, target, {}, (desc.width + 7) / 8, (desc.height + 7) / 8);
  }
  return true;
}

}  // namespace lumigraft::relight::gpu
