#pragma once
// Parsing and serialisation of the stream's messages, as in docs/protocol.md. Pure functions.
#include <Eigen/Geometry>
#include <atomic>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

#include "relight/exhibit/exhibit.h"

namespace lumigraft::server {

constexpr int kProtocolVersion = 1;
constexpr std::size_t kStreamHeaderBytes = 32;

enum class StreamKind : std::uint8_t { config = 1, h264_key = 2, h264_delta = 3, jpeg = 4 };

struct StreamHeader {
  static constexpr std::uint16_t kPassedThrough = 1;

  StreamKind kind = StreamKind::jpeg;
  std::uint16_t flags = 0;
  std::uint32_t sequence = 0;
  std::uint16_t width = 0, height = 0;
  std::int64_t capture_time_ns = 0;  ///< since 1970 UTC
  std::int64_t send_time_ns = 0;     ///< since 1970 UTC
};

enum class Codec { none, h264, jpeg };
enum class StreamSize { full, half };  ///< half: of width and height

/// One binary message, shared by all viewers that receive it.
struct StreamMessage {
  StreamHeader header;
  /// The same moment as the header's capture time, on a clock that nobody sets: durations are of this one.
  std::chrono::steady_clock::time_point captured{};
  StreamSize size = StreamSize::full;
  std::vector<std::uint8_t> bytes;  ///< header and payload
};
std::shared_ptr<const StreamMessage> make_stream_message(const StreamHeader& header,
                                                         std::span<const std::uint8_t> payload,
                                                         StreamSize size = StreamSize::full,
                                                         std::chrono::steady_clock::time_point captured = {});

/// Which encodings of one size viewers currently request: a kind that no viewer requests is not encoded.
struct SizeDemand {
  std::atomic<int> h264 = 0, jpeg = 0;  ///< viewers
  std::atomic<int> h264_busy = 0;       ///< of them, cannot be sent a picture now; while all are, none is encoded
  std::atomic<int> rate_kbit_s = 0;     ///< of H.264 at most; 0: without bound
  std::atomic<bool> key = false;        ///< a viewer needs a key frame; the encoder clears this
};

/// That of full size, and that of half.
struct EncoderDemand : SizeDemand {
  SizeDemand half;
  std::atomic<bool> publishing = false;  ///< H.264 of full size, to a media server

  bool any() const { return h264 > 0 || jpeg > 0 || half.h264 > 0 || half.jpeg > 0 || publishing; }
  SizeDemand& of(StreamSize size) { return size == StreamSize::half ? half : *this; }
};

/// The material properties that a message sets: a new value, or none to restore the model's own.
struct MaterialChange {
  bool models_own = false;  ///< restores all properties
  std::optional<std::optional<Eigen::Vector3f>> base_color, emission, attenuation_color;
  std::optional<std::optional<float>> metallic, roughness, specular, transmission, ior, attenuation_distance_m,
      clearcoat, clearcoat_roughness;
  std::optional<std::optional<bool>> thin_walled;
};

/// What a message sets of an object's animation.
struct AnimationChange {
  std::optional<std::string> name;
  std::optional<bool> playing, loop;
  std::optional<double> at_s;  ///< the moment of the animation to show now
};

struct WantCommand {
  Codec codec = Codec::none;
  std::optional<StreamSize> size;  ///< none: as the viewer's network permits
};
struct KeyCommand {};
struct AckCommand {
  std::uint32_t sequence = 0;
};
struct ObjectCommand {
  std::variant<std::size_t, std::string> object;  ///< index or name
  std::optional<Eigen::Vector3d> position_m;
  std::optional<Eigen::Vector2d> on_pixel;     ///< in place of position_m: on the surface that this pixel shows
  std::optional<Eigen::Quaterniond> rotation;  ///< unit
  std::optional<double> yaw_degrees;
  std::optional<bool> visible;
  bool reset = false;  ///< first, all of the object is as configured again
  std::optional<MaterialChange> material;
  std::optional<AnimationChange> animation;
  std::optional<std::optional<std::string>> variant;  ///< none: the default materials
};
struct RecordCommandOfViewer {
  bool on = false;
};
/// Controls the playback of a recording.
struct PlaybackCommand {
  std::optional<double> at_s;  ///< seek to this time since the recording's start
  std::optional<bool> paused;
  bool step = false;  ///< advance by one frame
};
/// Makes what is shown the start of the exhibit.
struct SaveCommand {};
struct BadCommand {
  std::string error;  ///< what is wrong and what is allowed
};
using Command = std::variant<WantCommand, KeyCommand, AckCommand, ObjectCommand, RecordCommandOfViewer, PlaybackCommand,
                             SaveCommand, BadCommand>;

/// Parses a client's text message and checks every value. Never throws.
Command parse_command(std::string_view text);

std::string error_message(std::string_view error);
/// The answer to SaveCommand; an empty error: it was saved.
std::string saved_message(std::string_view error);

}  // namespace lumigraft::server
