#pragma once
// Where pictures come from. One source may deliver several streams (a depth camera gives colour and depth).
//
// A live source blocks in next() until a picture is there or the timeout is over; a recording returns at once.
#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "capture/frame.h"
#include "capture/session/session.h"

namespace lumigraft::capture {

/// Depth as the sensor gave it, before registration to colour.
struct RawDepth {
  Stamp stamp;
  Image<std::uint16_t> counts;  ///< 0 = no measurement
};

/// A picture that could not be had: its place in the stream is kept, so pairing and counting stay right.
struct LostPicture {
  Stamp stamp;
  Stream stream = Stream::color;
  std::string reason;
};

using SourceItem = std::variant<Picture, RawDepth, LostPicture>;
const Stamp& stamp_of(const SourceItem& item);
Stream stream_of(const SourceItem& item);
const char* name_of(Stream stream);  ///< in messages

class Source {
 public:
  virtual ~Source() = default;
  /// The next item of any of this source's streams, in time order per stream. Empty: end of a recording, or timeout.
  virtual std::optional<SourceItem> next(std::chrono::milliseconds timeout) = 0;
  /// True once a recording is over, or a device that nobody opens again (LiveSource does) is gone.
  virtual bool finished() const = 0;
  /// Back to the first picture. Live sources do nothing.
  virtual void rewind() = 0;
  /// What keeps a camera from giving pictures, on one line; empty where nothing does.
  virtual std::string fault() const { return {}; }
  /// What is wrong with its pictures though they come, on one line and told once; empty where nothing is.
  virtual std::string take_warning() { return {}; }
  /// What the camera itself says tells it from others of its kind; empty where it does not, or never was there.
  virtual std::string serial() const { return {}; }
  /// Whether the times of its pictures are those of this host's steady clock, so that no clock need be estimated.
  virtual bool on_host_clock() const { return false; }
  /// Whether the next item is there already and of the same moment: the rest of a bracket.
  virtual bool bracket_goes_on() const { return false; }
};

/// FrameSets in order: opens the session's sources, registers depth to colour, pairs by timestamp.
class FrameReader {
 public:
  virtual ~FrameReader() = default;
  /// Empty: end of the recording (finished() is true), or timeout.
  virtual std::optional<FrameSet> next(std::chrono::milliseconds timeout) = 0;
  virtual bool finished() const = 0;
  virtual void rewind() = 0;
  virtual bool live() const = 0;
  /// One line for each camera that gives no pictures now. They come back by themselves.
  virtual std::vector<std::string> troubles() const { return {}; }
};

/// Opens and checks every source; contradictory or missing files throw InputError here, before the first frame.
std::unique_ptr<FrameReader> open_frames(const Session& session);

}  // namespace lumigraft::capture
