#include "capture/live/aravis/chunks.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <span>

#include "capture/live/parameters.h"

namespace lumigraft::capture::aravis {
namespace {

constexpr std::uint64_t kNsPerS = 1'000'000'000;
constexpr std::size_t kNumber = 4;             ///< bytes of a chunk's ID, and of its length
constexpr std::size_t kTrailer = 2 * kNumber;  ///< ID and length, after each chunk

bool disabled_by(const CameraSettings& settings) {
  return std::ranges::count(settings.controls, std::pair(std::string("ChunkModeActive"), 0.0)) > 0;
}

/// Converts ticks of frequency f to nanoseconds without overflow of 64 bits.
std::uint64_t ns_of(std::uint64_t ticks, std::uint64_t f) { return ticks / f * kNsPerS + ticks % f * kNsPerS / f; }

/// Whether two times may belong to one frame: they differ by less than exposure and transfer can take.
bool are_near(std::uint64_t a_ns, std::uint64_t b_ns) {
  // Unsigned: the smaller one is the distance.
  return std::min(a_ns - b_ns, b_ns - a_ns) <= kAravisParameters.max_time_difference_ns;
}

std::uint64_t number_at(std::span<const std::uint8_t> bytes, std::size_t at, bool big_endian) {
  std::uint64_t number = 0;
  for (std::size_t i = 0; i < kNumber; ++i) number = number << 8 | bytes[at + (big_endian ? i : kNumber - 1 - i)];
  return number;
}

std::vector<ArvGcPropertyNode*> properties_of(ArvGcNode* node) {
  std::vector<ArvGcPropertyNode*> out;
  for (ArvDomNode* child = node != nullptr ? arv_dom_node_get_first_child(ARV_DOM_NODE(node)) : nullptr;
       child != nullptr; child = arv_dom_node_get_next_sibling(child)) {
    if (ARV_IS_GC_PROPERTY_NODE(child)) out.push_back(ARV_GC_PROPERTY_NODE(child));
  }
  return out;
}

/// Chunk ID of a port; empty if it is not the port of a chunk.
std::optional<std::uint32_t> chunk_id(ArvGcNode* port) {
  for (ArvGcPropertyNode* property : properties_of(port)) {
    if (arv_gc_property_node_get_node_type(property) == ARV_GC_PROPERTY_NODE_TYPE_CHUNK_ID) {
      const char* name = arv_gc_property_node_get_string(property, nullptr);
      return static_cast<std::uint32_t>(std::strtoull(name != nullptr ? name : "", nullptr, 16));
    }
  }
  return std::nullopt;
}

}  // namespace

Chunks::Chunks(ArvCamera& camera, const StreamSpec& spec) {
  Check check;
  ArvDevice* device = arv_camera_get_device(&camera);
  if (disabled_by(spec.settings) || !arv_camera_are_chunks_available(&camera, check)) return;
  arv_camera_set_chunk_mode(&camera, TRUE, check);
  if (check.failed()) {
    refused_ = check.text();
    return;
  }
  big_endian_ = ARV_IS_GV_DEVICE(device);
  if (ARV_IS_GV_DEVICE(device)) ticks_per_s_ = arv_gv_device_get_timestamp_tick_frequency(ARV_GV_DEVICE(device), check);
  time_ = enable(camera, "Timestamp", ARV_TYPE_GC_INTEGER);
  exposure_ = enable(camera, "ExposureTime", ARV_TYPE_GC_FLOAT);
  ArvGcNode* gain = arv_device_get_feature(device, "Gain");  // if absent, `gain` is in the camera's own steps
  if (ARV_IS_GC_FLOAT(gain)) {
    const char* unit = arv_gc_float_get_unit(ARV_GC_FLOAT(gain));
    gain_in_db_ = unit != nullptr && std::string(unit) == "dB";
    gain_ = enable(camera, "Gain", ARV_TYPE_GC_FLOAT);
  }
  if (time_ || exposure_ || gain_) {
    parser_.reset(arv_camera_create_chunk_parser(&camera));
  } else {
    arv_camera_set_chunk_mode(&camera, FALSE, check);
  }
}

/// Chunks that contain the registers of a feature, each with the end of its last register.
std::vector<Chunks::RequiredChunk> Chunks::chunks_of(ArvGcNode* node, int depth) {
  std::vector<RequiredChunk> out;
  if (depth > kAravisParameters.max_feature_depth) return out;
  for (ArvGcPropertyNode* property : properties_of(node)) {
    const ArvGcPropertyNodeType type = arv_gc_property_node_get_node_type(property);
    if (type == ARV_GC_PROPERTY_NODE_TYPE_P_VALUE || type == ARV_GC_PROPERTY_NODE_TYPE_P_VARIABLE) {
      const std::vector<RequiredChunk> deeper = chunks_of(arv_gc_property_node_get_linked_node(property), depth + 1);
      out.insert(out.end(), deeper.begin(), deeper.end());
    } else if (type == ARV_GC_PROPERTY_NODE_TYPE_P_PORT && ARV_IS_GC_REGISTER(node)) {
      Check address, size;
      const guint64 from = arv_gc_register_get_address(ARV_GC_REGISTER(node), address);
      const guint64 length = arv_gc_register_get_length(ARV_GC_REGISTER(node), size);
      const auto chunk = chunk_id(arv_gc_property_node_get_linked_node(property));
      if (chunk && !address.failed() && !size.failed() && from <= G_MAXUINT32 && length <= G_MAXUINT32) {
        out.push_back({*chunk, from + length});
      }
    }
  }
  return out;
}

/// Enables one chunk. Empty if the camera does not offer it or refuses.
std::optional<Chunks::Feature> Chunks::enable(ArvCamera& camera, const std::string& name, GType type) {
  Check check;
  const std::vector<std::string> all = entries_of(&camera, "ChunkSelector", check);
  if (std::find(all.begin(), all.end(), name) == all.end()) return std::nullopt;
  Feature feature{"Chunk" + name, {}};
  ArvGcNode* node = arv_device_get_feature(arv_camera_get_device(&camera), feature.name.c_str());
  if (node == nullptr || !G_TYPE_CHECK_INSTANCE_TYPE(node, type)) return std::nullopt;
  feature.chunks = chunks_of(node);
  if (feature.chunks.empty()) return std::nullopt;
  arv_camera_set_chunk_state(&camera, name.c_str(), TRUE, check);
  const std::string why = check.text();
  if (!arv_camera_get_chunk_state(&camera, name.c_str(), check) ||
      check.failed()) {  // some chunks are always on and cannot be set
    refused_ = feature.name + (why.empty() ? "" : ": " + why);
    return std::nullopt;
  }
  return feature;
}

bool Chunks::are_complete(ArvBuffer& buffer, std::size_t frame_bytes) const {
  std::size_t size = 0;
  const auto* data = static_cast<const std::uint8_t*>(arv_buffer_get_data(&buffer, &size));
  const std::span<const std::uint8_t> bytes(data, data != nullptr ? size : 0);
  // From the end of the buffer to the image, which may itself be the first chunk.
  for (std::size_t end = bytes.size(); end >= frame_bytes + kTrailer;) {
    const std::size_t trailer = end - kTrailer;
    const std::uint64_t length = number_at(bytes, trailer + kNumber, big_endian_);
    if (length > trailer) return false;
    end = trailer - length;
    if (end == frame_bytes || (end == 0 && trailer == frame_bytes)) return true;
  }
  return false;
}

/// Why a feature cannot be read from this buffer; empty if its chunks are present and long enough.
std::string Chunks::rejection_reason(const Feature& feature, ArvBuffer& buffer) const {
  for (const RequiredChunk& chunk : feature.chunks) {
    std::size_t length = 0;
    if (arv_buffer_get_chunk_data(&buffer, chunk.id, &length) == nullptr) return feature.name + " is missing";
    if (length < chunk.min_bytes) {
      return feature.name + " has " + std::to_string(length) + " bytes, not " + std::to_string(chunk.min_bytes);
    }
  }
  return {};
}

std::optional<std::int64_t> Chunks::time_ns(ArvBuffer& buffer, std::string& fault) const {
  fault = rejection_reason(*time_, buffer);
  if (!fault.empty()) return std::nullopt;
  Check check;
  const auto value = static_cast<std::uint64_t>(
      arv_chunk_parser_get_integer_value(parser_.get(), &buffer, time_->name.c_str(), check));
  if (check.failed()) {
    fault = check.text();
    return std::nullopt;
  }
  // Some cameras report the chunk's time in nanoseconds, others in ticks of their clock; the leader's time decides.
  const std::uint64_t leader_ns = arv_buffer_get_timestamp(&buffer);
  if (are_near(value, leader_ns)) return static_cast<std::int64_t>(value);
  if (ticks_per_s_ > 0 && ticks_per_s_ <= kNsPerS && are_near(ns_of(value, ticks_per_s_), leader_ns)) {
    return static_cast<std::int64_t>(ns_of(value, ticks_per_s_));
  }
  fault = time_->name + " is not the time of its frame";
  return std::nullopt;
}

std::optional<double> Chunks::number(const Feature& feature, ArvBuffer& buffer, std::string& fault) const {
  fault = rejection_reason(feature, buffer);
  if (!fault.empty()) return std::nullopt;
  Check check;
  const double value = arv_chunk_parser_get_float_value(parser_.get(), &buffer, feature.name.c_str(), check);
  if (check.failed()) {
    fault = check.text();
    return std::nullopt;
  }
  return value;
}

FrameSettings Chunks::read(ArvBuffer& buffer, std::size_t frame_bytes) const {
  FrameSettings own;
  if (!arv_buffer_has_chunks(&buffer)) {
    own.fault = "it has none";
    return own;
  }
  if (!are_complete(buffer, frame_bytes)) {
    own.fault = "their lengths are wrong";
    return own;
  }
  std::string fault;
  const auto note = [&] {
    if (own.fault.empty()) own.fault = fault;
  };
  if (time_) {
    own.time_ns = time_ns(buffer, fault);
    note();
  }
  if (exposure_) {
    own.reported.exposure_us = number(*exposure_, buffer, fault);
    note();
  }
  if (gain_) {
    own.reported.gain = number(*gain_, buffer, fault);
    note();
  }
  return own;
}

}  // namespace lumigraft::capture::aravis
