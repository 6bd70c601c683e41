#include "relight/exhibit/gltf/buffers.h"

#include <algorithm>
#include <utility>

#include "relight/exhibit/gltf/meshopt.h"
#include "relight/exhibit/gltf/parameters.h"
#include "relight/exhibit/gltf/uri.h"

namespace lumigraft::relight {

std::span<const std::uint8_t> GltfBuffers::buffer(std::size_t index) {
  const GltfValue value = document_.root().member("buffers")[index];
  const std::size_t length = value.member("byteLength").integer(1, kGltf.max_file_bytes);
  std::span<const std::uint8_t> bytes;
  if (const auto loaded = buffers_.find(index); loaded != buffers_.end()) {
    bytes = loaded->second;
  } else if (const GltfValue uri = value.member("uri"); uri.exists()) {
    std::vector<std::uint8_t> content =
        read_uri(uri, document_.file().parent_path(), kGltf.max_file_bytes - loaded_bytes_);
    loaded_bytes_ += content.size();
    bytes = buffers_.emplace(index, std::move(content)).first->second;
  } else {
    if (index != 0 || document_.binary_chunk().empty()) uri.refuse("where the buffer's data is");
    bytes = document_.binary_chunk();
  }
  if (length > bytes.size()) {
    value.member("byteLength").refuse("at most " + std::to_string(bytes.size()) + ", the bytes of its data");
  }
  return bytes.first(length);
}

std::span<const std::uint8_t> GltfBuffers::part(const GltfValue& of) {
  const std::size_t index = of.member("buffer").index(document_.root().member("buffers").size(), "buffers");
  const std::span<const std::uint8_t> all = buffer(index);
  const std::size_t offset = of.integer("byteOffset", 0, kGltf.max_file_bytes, 0),
                    length = of.member("byteLength").integer(1, kGltf.max_file_bytes);
  if (offset + length > all.size()) {
    of.fail("found bytes " + std::to_string(offset) + " to " + std::to_string(offset + length) + ", allowed: the " +
            std::to_string(all.size()) + " of its buffer");
  }
  return all.subspan(offset, length);
}

/// A view counts once, when it is asked for: those before it are done.
void GltfBuffers::report_progress(std::size_t of_view) {
  const std::size_t all = document_.binary_chunk().size() + loaded_bytes_;
  if (all > 0)
    reported_ = std::max(reported_, std::min(static_cast<float>(bytes_requested_) / static_cast<float>(all), 0.99f));
  progress_(reported_);
  if (requested_.size() <= of_view) requested_.resize(of_view + 1);
  if (requested_[of_view]) return;
  requested_[of_view] = true;
  bytes_requested_ += document_.root().member("bufferViews")[of_view].integer("byteLength", 0, kGltf.max_file_bytes, 0);
}

GltfBuffers::View GltfBuffers::view(const GltfValue& reference) {
  const GltfValue views = document_.root().member("bufferViews");
  const std::size_t index = reference.index(views.size(), "bufferViews");
  const GltfValue value = views[index];
  if (progress_) report_progress(index);
  const std::size_t stride = value.integer("byteStride", 4, 252, 0);
  const GltfValue compressed = value.extension("EXT_meshopt_compression");
  if (!compressed.exists()) return {part(value), stride};
  const auto [found, is_new] = decompressed_.try_emplace(index);
  if (is_new) {
    found->second = decode_meshopt(compressed, part(compressed));
    loaded_bytes_ += found->second.size();
    if (loaded_bytes_ > kGltf.max_file_bytes) {
      value.fail("found more than " + std::to_string(kGltf.max_file_bytes) +
                 " bytes of buffers and compressed views up to here, allowed: as many");
    }
  }
  return {found->second, stride};
}

}  // namespace lumigraft::relight
