#pragma once
// What a camera of GenICam says beside each picture of it: its own moment, exposure and gain. Included by .cpp files
// alone.
//
// Behind a picture stand chunks, and behind each chunk its name and its length (GigE Vision 2.0, "chunk data"; USB3
// Vision 1.0; names and units as in GenICam's SFNC 2.7, ChunkDataControl). A chunk that is torn, missing or cannot be
// true costs what it would have told, never the picture.
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "capture/live/aravis/library.h"
#include "capture/session/stream_spec.h"

namespace lumigraft::capture::aravis {

/// Of one picture; empty where it is not known.
struct OwnSettings {
  std::optional<std::int64_t> time_ns;  ///< on the clock of the leader's time
  std::optional<double> exposure;       ///< as Picture::exposure
  std::string fault;                    ///< the first reason for an empty one, where a camera has the chunk
};

class Chunks {
 public:
  /// Switches on what the camera offers of them and the session can use; nothing where `controls` say no. Before the
  /// camera is asked how large its pictures are. Never throws: a camera that refuses goes on without.
  Chunks(ArvCamera& camera, const StreamSpec& spec);

  bool active() const { return parser_ != nullptr; }
  /// Why a camera that has chunks gives none; empty where nothing is wrong.
  const std::string& refused() const { return refused_; }

  /// Of a picture that came whole. Pixels take up `picture_bytes`, padding included.
  OwnSettings read(ArvBuffer& buffer, std::size_t picture_bytes) const;

  /// Whether the chunks of a picture and nothing else stand behind its pixels.
  bool are_whole(ArvBuffer& buffer, std::size_t picture_bytes) const;

 private:
  /// The library reads what lies behind a chunk that is too short, so we know how long it must be.
  struct Need {
    std::uint32_t chunk = 0;
    std::uint64_t bytes = 0;
  };
  struct Feature {
    std::string name;
    std::vector<Need> needs;
  };

  static std::vector<Need> needs_of(ArvGcNode* node, int depth = 0);
  std::optional<Feature> switched_on(ArvCamera& camera, const std::string& name, GType type);
  std::string reason_against(const Feature& feature, ArvBuffer& buffer) const;
  std::optional<std::int64_t> time_ns(ArvBuffer& buffer, std::string& fault) const;
  std::optional<double> number(const Feature& feature, ArvBuffer& buffer, std::string& fault) const;

  StreamSpec spec_;
  bool big_endian_ = true;
  bool gain_in_db_ = false;
  std::uint64_t ticks_per_s_ = 0;
  std::optional<Feature> time_, exposure_, gain_;
  std::string refused_;
  Ref<ArvChunkParser> parser_;
};

}  // namespace lumigraft::capture::aravis
