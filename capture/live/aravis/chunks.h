#pragma once
// Chunk data of GenICam cameras: time, exposure and gain of each frame. Included by .cpp files alone.
//
// Chunks follow the image in a buffer, each followed by its ID and length (GigE Vision 2.0, "chunk data"; USB3 Vision
// 1.0; names and units as in GenICam's SFNC 2.7, ChunkDataControl). If a chunk is damaged, missing or implausible, its
// value is not used, but the frame is.
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "capture/live/aravis/library.h"
#include "capture/live/reported_exposure.h"
#include "capture/session/stream_spec.h"

namespace lumigraft::capture::aravis {

/// Settings of one frame; empty where not known.
struct FrameSettings {
  std::optional<std::int64_t> time_ns;  ///< on the clock of the leader's time
  ReportedSettings reported;
  std::string fault;  ///< first reason why the chunk of a value could not be used
};

class Chunks {
 public:
  /// Enables those chunks that the camera offers and that are used; none if the session sets
  /// `controls.ChunkModeActive = 0`. Must come before the payload size is read. Never throws: if the camera refuses,
  /// chunks are not used.
  Chunks(ArvCamera& camera, const StreamSpec& spec);

  bool report_exposure() const { return exposure_.has_value(); }
  bool report_gain() const { return gain_.has_value(); }
  bool gain_in_db() const { return gain_in_db_; }
  bool active() const { return parser_ != nullptr; }
  /// Why a camera with chunks does not deliver them; empty if nothing is wrong.
  const std::string& refused() const { return refused_; }

  /// Settings of a complete frame. Pixels take `frame_bytes`, padding included.
  FrameSettings read(ArvBuffer& buffer, std::size_t frame_bytes) const;

  /// Whether the chunks fill the buffer exactly from the end of the pixels.
  bool are_complete(ArvBuffer& buffer, std::size_t frame_bytes) const;

 private:
  /// Aravis reads past the end of a chunk that is too short, so the required length is checked here.
  struct RequiredChunk {
    std::uint32_t id = 0;
    std::uint64_t min_bytes = 0;
  };
  struct Feature {
    std::string name;
    std::vector<RequiredChunk> chunks;
  };

  static std::vector<RequiredChunk> chunks_of(ArvGcNode* node, int depth = 0);
  std::optional<Feature> enable(ArvCamera& camera, const std::string& name, GType type);
  std::string rejection_reason(const Feature& feature, ArvBuffer& buffer) const;
  std::optional<std::int64_t> time_ns(ArvBuffer& buffer, std::string& fault) const;
  std::optional<double> number(const Feature& feature, ArvBuffer& buffer, std::string& fault) const;

  bool big_endian_ = true;
  bool gain_in_db_ = false;
  std::uint64_t ticks_per_s_ = 0;
  std::optional<Feature> time_, exposure_, gain_;
  std::string refused_;
  Ref<ArvChunkParser> parser_;
};

}  // namespace lumigraft::capture::aravis
