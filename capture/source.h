#pragma once
// Interface of cameras and recordings. One source may deliver several streams (a depth camera gives colour and depth).
//
// A live source blocks in next() until a frame arrives or the timeout is over; a recording returns at once.
#include <chrono>
#include <memory>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "capture/frame.h"
#include "capture/session/session.h"

namespace lumigraft::capture {

/// A frame that was lost. It keeps its place in the stream, so that pairing and counting stay correct.
struct LostFrame {
  Stamp stamp;
  Stream stream = Stream::color;
  std::string reason;
};

using SourceItem = std::variant<Frame, RawDepth, LostFrame>;
const Stamp& stamp_of(const SourceItem& item);
Stream stream_of(const SourceItem& item);
const char* name_of(Stream stream);  ///< for messages

class Source {
 public:
  virtual ~Source() = default;
  /// The next item of any of the source's streams, in time order per stream. Empty: end of a recording, or timeout.
  virtual std::optional<SourceItem> next(std::chrono::milliseconds timeout) = 0;
  /// True after the end of a recording, or after a device has gone. LiveSource opens devices again and never finishes.
  virtual bool finished() const = 0;
  /// Returns to the first frame. Live sources do nothing.
  virtual void rewind() = 0;
  /// Reason why a camera delivers no frames, one line; empty if there is none.
  virtual std::string fault() const { return {}; }
  /// Defect of frames that the camera does deliver, one line, returned once; empty if there is none.
  virtual std::string take_warning() { return {}; }
  /// Serial number that the camera reports; empty if it reports none or was never opened.
  virtual std::string serial() const { return {}; }
  /// Whether frame times are on this host's steady clock, so that no clock offset has to be estimated.
  virtual bool on_host_clock() const { return false; }
  /// Whether the next item is ready and belongs to the same bracket as the last one.
  virtual bool bracket_incomplete() const { return false; }
};

/// Passes on what another source gives.
class ForwardingSource : public Source {
 public:
  std::optional<SourceItem> next(std::chrono::milliseconds timeout) override { return source_->next(timeout); }
  bool finished() const override { return source_->finished(); }
  void rewind() override { source_->rewind(); }
  std::string fault() const override { return source_->fault(); }
  std::string take_warning() override { return source_->take_warning(); }
  std::string serial() const override { return source_->serial(); }
  bool on_host_clock() const override { return source_->on_host_clock(); }
  bool bracket_incomplete() const override { return source_->bracket_incomplete(); }

 protected:
  explicit ForwardingSource(std::shared_ptr<Source> source) : source_(std::move(source)) {}
  const std::shared_ptr<Source> source_;
};

/// FrameSets in order.
class FrameReader {
 public:
  virtual ~FrameReader() = default;
  /// Empty: end of the recording (finished() is true), or timeout.
  virtual std::optional<FrameSet> next(std::chrono::milliseconds timeout) = 0;
  virtual bool finished() const = 0;
  virtual void rewind() = 0;
  virtual bool live() const = 0;
  /// One line for each camera that delivers no frames at present. Such cameras are opened again automatically.
  virtual std::vector<std::string> faults() const { return {}; }
};

/// Opens and checks all sources, and pairs their frames by timestamps. Contradictory or missing files throw InputError
/// here, before the first frame, and so does `helper:`, for which open_sources is. Depth is on the depth camera's
/// pixels: the pipeline registers it in a separate stage.
std::unique_ptr<FrameReader> open_paired_frames(const Session& session);
/// The same with depth registered to colour.
std::unique_ptr<FrameReader> open_frames(const Session& session);

}  // namespace lumigraft::capture
