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
  /// `progress`: called with the fraction of the buffers' bytes that was requested before the last view; may be empty.
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
  void report_progress(std::size_t of_view);

  std::size_t loaded_bytes_ = 0;
  LoadProgress progress_;
  std::vector<bool> requested_;  // by index of the view
  std::size_t bytes_requested_ = 0;
  float reported_ = 0;
};

}  // namespace lumigraft::relight
