#pragma once
// Values of accessors: interleaved, sparse, of all component types.
#include <cstdint>
#include <string>
#include <vector>

#include "relight/exhibit/gltf/buffers.h"
#include "relight/exhibit/gltf/parameters.h"

namespace lumigraft::relight {

/// Component types, as bits of a set.
enum GltfComponents : unsigned {
  kGltfByte = 1,
  kGltfUnsignedByte = 2,
  kGltfShort = 4,
  kGltfUnsignedShort = 8,
  kGltfUnsignedInt = 16,
  kGltfFloat = 32,
};

struct GltfAccessorFormat {
  GltfComponents type = kGltfFloat;
  bool normalized = false;     ///< integers are converted to -1 to 1 or 0 to 1
  std::size_t components = 1;  ///< per element
  std::size_t count = 0;       ///< elements

  /// The value of a normalized integer.
  float from_integer(float c) const;
};

class GltfAccessors {
 public:
  GltfAccessors(const GltfDocument& document, GltfBuffers& buffers) : document_(document), buffers_(buffers) {}

  /// `reference` is the index of an accessor, here and below. Throws InputError.
  GltfAccessorFormat format(const GltfValue& reference) const;
  /// All components, converted to floats. Throws InputError.
  std::vector<float> floats(const GltfValue& reference);
  /// Of a scalar accessor of unsigned integers. Throws InputError.
  std::vector<std::uint32_t> indices(const GltfValue& reference);
  /// Counts elements against the limit of a file. Throws InputError where it is exceeded.
  void charge(const GltfValue& for_what, std::size_t elements);
  /// "FLOAT", "SHORT, normalized"
  static std::string name_of(GltfComponents type, bool normalized);

 private:
  GltfValue accessor(const GltfValue& reference) const;
  template <typename To, typename Convert>
  std::vector<To> read(const GltfValue& reference, const GltfAccessorFormat& format, const Convert& convert);

  const GltfDocument& document_;
  GltfBuffers& buffers_;
  std::size_t elements_left_ = kGltf.max_elements;
};

}  // namespace lumigraft::relight
