#include "relight/exhibit/gltf/meshopt.h"

#include <meshoptimizer.h>

#include "relight/exhibit/gltf/parameters.h"

namespace lumigraft::relight {
namespace {

void apply_filter(const GltfValue& extension, std::size_t count, std::size_t stride, std::vector<std::uint8_t>& data) {
  const std::string filter = extension.text("filter", "NONE");
  const auto check_stride = [&](bool allowed, const char* strides) {
    if (!allowed) extension.member("byteStride").refuse(std::string(strides) + " with the filter " + filter);
  };
  if (filter == "OCTAHEDRAL") {
    check_stride(stride == 4 || stride == 8, "4 or 8");
    meshopt_decodeFilterOct(data.data(), count, stride);
  } else if (filter == "QUATERNION") {
    check_stride(stride == 8, "8");
    meshopt_decodeFilterQuat(data.data(), count, stride);
  } else if (filter == "EXPONENTIAL") {
    check_stride(stride % 4 == 0, "a multiple of 4");
    meshopt_decodeFilterExp(data.data(), count, stride);
  } else if (filter != "NONE") {
    extension.member("filter").refuse("NONE, OCTAHEDRAL, QUATERNION or EXPONENTIAL");
  }
}

}  // namespace

std::vector<std::uint8_t> decode_meshopt(const GltfValue& extension, std::span<const std::uint8_t> bytes) {
  const std::string mode = extension.member("mode").text();
  const bool vertices = mode == "ATTRIBUTES", triangles = mode == "TRIANGLES";
  if (!vertices && !triangles && mode != "INDICES") {
    extension.member("mode").refuse("ATTRIBUTES, TRIANGLES or INDICES");
  }
  const std::size_t stride = extension.member("byteStride").integer(1, 256),
                    count = extension.member("count").integer(1, kGltf.max_elements);
  if (vertices ? stride % 4 != 0 : stride != 2 && stride != 4) {
    extension.member("byteStride").refuse(vertices ? "a multiple of 4" : "2 or 4");
  }
  if (triangles && count % 3 != 0) extension.member("count").refuse("a multiple of 3");
  if (count * stride > kGltf.max_expansion * bytes.size()) {
    extension.member("count").refuse("at most " + std::to_string(kGltf.max_expansion) + " bytes per compressed byte");
  }
  std::vector<std::uint8_t> data(count * stride);
  const int error = vertices    ? meshopt_decodeVertexBuffer(data.data(), count, stride, bytes.data(), bytes.size())
                    : triangles ? meshopt_decodeIndexBuffer(data.data(), count, stride, bytes.data(), bytes.size())
                                : meshopt_decodeIndexSequence(data.data(), count, stride, bytes.data(), bytes.size());
  if (error != 0)
    extension.fail("found data that cannot be decompressed, allowed: meshoptimizer's codec, version 0 or 1");
  apply_filter(extension, count, stride, data);
  return data;
}

}  // namespace lumigraft::relight
