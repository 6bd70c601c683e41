#pragma once
// Buffers of a glTF file and views of them, decompressed where EXT_meshopt_compression says so.
#include <cstdint>
#include <map>
#include <span>
#include <utility>
#include <vector>

#include "relight/exhibit/gltf/document.h"
#include "relight/exhibit/loading.h"

namespace lumigraft::relight {

/// Loads what is asked for, once. All verbs throw InputError that names the value that is wrong.
class GltfBuffers {
 public:
  /// `progress`: told the share of the buffers' bytes that was asked for, without what is made of the last; may be
  /// empty.
  explicit GltfBuffers(const GltfDocument& document, LoadProgress progress = {})
      : document_(document), progress_(std::move(progress)) {}

  struct View {
    std::span<const std::uint8_t> bytes;
    std::size_t stride = 0;  ///< bytes from an element to the next; 0: elements have no gaps
  };
  /// `reference` is the index of a buffer view.
  View view(const GltfValue& reference);

 private:
  std::span<const std::uint8_t> buffer(std::size_t index);
  /// Of an object with buffer, byteOffset and byteLength.
  std::span<const std::uint8_t> part(const GltfValue& of);

  const GltfDocument& document_;
  std::map<std::size_t, std::vector<std::uint8_t>> buffers_, decompressed_;  // by index of the buffer or view
  void tell_progress(std::size_t of_view);

  std::size_t loaded_bytes_ = 0;
  LoadProgress progress_;
  std::vector<bool> asked_for_;  // by index of the view
  std::size_t bytes_asked_for_ = 0;
  float told_ = 0;
};

}  // namespace lumigraft::relight
