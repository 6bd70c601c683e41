#include "relight/exhibit/gltf/accessor.h"

#include <algorithm>
#include <cstring>
#include <optional>
#include <span>
#include <type_traits>
#include <utility>

namespace lumigraft::relight {
namespace {

using Bytes = std::span<const std::uint8_t>;

GltfComponents component_type(const GltfValue& value) {
  switch (value.exists() ? value.integer(0, 65535) : 0) {
    case 5120:
      return kGltfByte;
    case 5121:
      return kGltfUnsignedByte;
    case 5122:
      return kGltfShort;
    case 5123:
      return kGltfUnsignedShort;
    case 5125:
      return kGltfUnsignedInt;
    case 5126:
      return kGltfFloat;
    default:
      value.refuse("5120, 5121, 5122, 5123, 5125 or 5126");
  }
}

std::size_t bytes_of(GltfComponents type) {
  if (type == kGltfByte || type == kGltfUnsignedByte) return 1;
  return type == kGltfShort || type == kGltfUnsignedShort ? 2 : 4;
}

std::size_t components_of(const GltfValue& type) {
  const std::string name = type.text();
  for (const auto& [known, count] : {std::pair{"SCALAR", 1}, {"VEC2", 2}, {"VEC3", 3}, {"VEC4", 4}, {"MAT4", 16}}) {
    if (name == known) return static_cast<std::size_t>(count);
  }
  type.refuse("SCALAR, VEC2, VEC3, VEC4 or MAT4 here");
}

/// Calls `use` with a value of the component's type.
template <typename Use>
void with_type(GltfComponents type, const Use& use) {
  switch (type) {
    case kGltfByte:
      return use(std::int8_t{});
    case kGltfUnsignedByte:
      return use(std::uint8_t{});
    case kGltfShort:
      return use(std::int16_t{});
    case kGltfUnsignedShort:
      return use(std::uint16_t{});
    case kGltfUnsignedInt:
      return use(std::uint32_t{});
    case kGltfFloat:
      return use(float{});
  }
}

/// Elements in bytes, checked against the bytes' end.
struct Elements {
  Bytes bytes;
  std::size_t stride;

  Elements(const GltfValue& from, const GltfBuffers::View& view, std::size_t offset, std::size_t element_bytes,
           std::size_t count)
      : bytes(view.bytes), stride(view.stride ? view.stride : element_bytes) {
    if (stride < element_bytes) {
      from.fail("found elements of " + std::to_string(element_bytes) + " bytes, allowed: at most the byteStride " +
                std::to_string(stride) + " of its view");
    }
    const std::size_t end = count ? offset + (count - 1) * stride + element_bytes : offset;
    if (end > bytes.size()) {
      from.fail("found elements up to byte " + std::to_string(end) + ", allowed: the " + std::to_string(bytes.size()) +
                " bytes of its view");
    }
    bytes = bytes.subspan(offset);
  }

  template <typename T>
  T at(std::size_t element, std::size_t component) const {
    T value;
    std::memcpy(&value, bytes.data() + element * stride + component * sizeof(T), sizeof(T));
    return value;
  }
};

}  // namespace

float GltfAccessorFormat::from_integer(float c) const {
  switch (type) {
    case kGltfByte:
      return std::max(c / 127, -1.0f);
    case kGltfUnsignedByte:
      return c / 255;
    case kGltfShort:
      return std::max(c / 32767, -1.0f);
    case kGltfUnsignedShort:
      return c / 65535;
    default:
      return c;
  }
}

std::string GltfAccessors::name_of(GltfComponents type, bool normalized) {
  std::string name;
  switch (type) {
    case kGltfByte:
      name = "BYTE";
      break;
    case kGltfUnsignedByte:
      name = "UNSIGNED_BYTE";
      break;
    case kGltfShort:
      name = "SHORT";
      break;
    case kGltfUnsignedShort:
      name = "UNSIGNED_SHORT";
      break;
    case kGltfUnsignedInt:
      name = "UNSIGNED_INT";
      break;
    case kGltfFloat:
      name = "FLOAT";
      break;
  }
  return name + (normalized ? ", normalized" : "");
}

GltfValue GltfAccessors::accessor(const GltfValue& reference) const {
  const GltfValue accessors = document_.root().member("accessors");
  return accessors[reference.index(accessors.size(), "accessors")];
}

GltfAccessorFormat GltfAccessors::format(const GltfValue& reference) const {
  const GltfValue value = accessor(reference);
  return {.type = component_type(value.member("componentType")),
          .normalized = value.flag("normalized", false),
          .components = components_of(value.member("type")),
          .count = value.member("count").integer(1, kGltf.max_elements)};
}

void GltfAccessors::charge(const GltfValue& for_what, std::size_t elements) {
  if (elements > elements_left_) {
    for_what.fail("found " + std::to_string(elements) +
                  " elements more, allowed: " + std::to_string(kGltf.max_elements) + " of all accessors together");
  }
  elements_left_ -= elements;
}

template <typename To, typename Convert>
std::vector<To> GltfAccessors::read(const GltfValue& reference, const GltfAccessorFormat& format,
                                    const Convert& convert) {
  const GltfValue value = accessor(reference);
  const std::size_t width = format.components, element_bytes = bytes_of(format.type) * width;
  std::optional<Elements> all;
  if (const GltfValue view = value.member("bufferView"); view.exists()) {
    const std::size_t offset = value.integer("byteOffset", 0, kGltf.max_file_bytes, 0);
    all.emplace(value, buffers_.view(view), offset, element_bytes, format.count);
  } else if (format.count > kGltf.max_zeros) {
    value.member("count").refuse("at most " + std::to_string(kGltf.max_zeros) + " without a bufferView");
  }
  charge(value, format.count);
  std::vector<To> values(format.count * width);  // zeros without a view
  if (all) {
    with_type(format.type, [&]<typename From>(From) {
      for (std::size_t i = 0; i < format.count; ++i) {
        for (std::size_t k = 0; k < width; ++k) values[i * width + k] = convert(all->template at<From>(i, k));
      }
    });
  }

  const GltfValue sparse = value.member("sparse");
  if (!sparse.exists()) return values;
  const std::size_t count = sparse.member("count").integer(1, format.count);
  const GltfValue places = sparse.member("indices"), replaced = sparse.member("values");
  const GltfComponents place_type = component_type(places.member("componentType"));
  if (!(place_type & (kGltfUnsignedByte | kGltfUnsignedShort | kGltfUnsignedInt))) {
    places.member("componentType").refuse("5121, 5123 or 5125");
  }
  const Elements at(places, {buffers_.view(places.member("bufferView")).bytes, 0},
                    places.integer("byteOffset", 0, kGltf.max_file_bytes, 0), bytes_of(place_type), count);
  const Elements from(replaced, {buffers_.view(replaced.member("bufferView")).bytes, 0},
                      replaced.integer("byteOffset", 0, kGltf.max_file_bytes, 0), element_bytes, count);
  for (std::size_t i = 0; i < count; ++i) {
    std::size_t element = 0;
    with_type(place_type, [&]<typename Place>(Place) {
      if constexpr (std::is_unsigned_v<Place>) element = at.at<Place>(i, 0);
    });
    if (element >= format.count) {
      places.fail("found " + std::to_string(element) + ", allowed: less than the " + std::to_string(format.count) +
                  " elements");
    }
    with_type(format.type, [&]<typename From>(From) {
      for (std::size_t k = 0; k < width; ++k) values[element * width + k] = convert(from.at<From>(i, k));
    });
  }
  return values;
}

std::vector<float> GltfAccessors::floats(const GltfValue& reference) {
  const GltfAccessorFormat format = this->format(reference);
  return read<float>(reference, format, [&](auto value) {
    const auto x = static_cast<float>(value);
    return format.normalized ? format.from_integer(x) : x;
  });
}

std::vector<std::uint32_t> GltfAccessors::indices(const GltfValue& reference) {
  const GltfAccessorFormat format = this->format(reference);
  const bool unsigned_type = format.type & (kGltfUnsignedByte | kGltfUnsignedShort | kGltfUnsignedInt);
  if (!unsigned_type || format.components != 1) {
    accessor(reference).fail("found " + name_of(format.type, format.normalized) +
                             ", allowed: scalars of UNSIGNED_BYTE, UNSIGNED_SHORT or UNSIGNED_INT as indices");
  }
  return read<std::uint32_t>(reference, format, [](auto value) { return static_cast<std::uint32_t>(value); });
}

}  // namespace lumigraft::relight
