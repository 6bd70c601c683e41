#pragma once
// Colour, depth and fish-eye pictures that belong together by their timestamps.
//
// Colour leads: every colour picture becomes one FrameSet. Depth and fish-eye join it when their time lies within half
// a colour period of it, the nearest first; each is used at most once. What is late, alone, out of order or lost is
// dropped, counted and named in the warnings of the next FrameSet.
//
// A recording is read ahead until the answer is certain, so the same files always give the same FrameSets. A live
// picture waits for its depth one colour period at most, and for no fish-eye: one that comes after its colour picture
// was handed on, as every bracket does, joins the next, up to 250 ms later, since light is slow.
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "capture/source.h"
#include "capture/sync/stream_lane.h"

namespace lumigraft::capture {

/// Sources may be the same object: a depth camera delivers both. Depth and fish-eye may be null.
struct PairedSources {
  std::shared_ptr<Source> color;
  std::shared_ptr<Source> depth;
  std::shared_ptr<Source> fisheye;
  bool live = false;
  std::int64_t fisheye_offset_ns = 0;  ///< added to its times
};

/// What a session's cameras give, before it is paired. Throws as open_frames.
PairedSources open_sources(const Session& session);

/// Puts what live cameras say of themselves where the session names no serial number.
void take_serials(Session& session, const PairedSources& sources);

class PairingReader : public FrameReader {
 public:
  explicit PairingReader(PairedSources sources);

  std::optional<FrameSet> next(std::chrono::milliseconds timeout) override;
  bool finished() const override;
  void rewind() override;
  bool live() const override { return sources_.live; }
  std::vector<std::string> troubles() const override;

 private:
  using Warnings = std::vector<std::string>;

  StreamLane& lane_of(Stream stream);
  bool pull(Source& source, std::chrono::milliseconds timeout);
  void pull_all_waiting();
  std::vector<const Stamp*> good_colors() const;
  std::int64_t bound_ns() const;
  Source* wanted() const;

  FrameSet emit();
  static std::optional<std::int64_t> nearest_ns(const StreamLane& lane, bool lost, std::int64_t time_ns,
                                                std::int64_t bound);
  static std::optional<std::int64_t> newest_ns(const StreamLane& lane, std::int64_t from_ns, std::int64_t to_ns);
  std::shared_ptr<const RawDepth> take_depth(std::int64_t time_ns, std::int64_t bound, Warnings& warnings);
  std::vector<std::shared_ptr<const Picture>> take_fisheye(std::int64_t time_ns, std::int64_t bound,
                                                           Warnings& warnings);

  PairedSources sources_;
  StreamLane color_;
  StreamLane depth_;
  StreamLane fisheye_;
  std::optional<Stamp> last_color_;      ///< of the newest FrameSet
  std::deque<std::int64_t> periods_ns_;  ///< the newest gaps between colour pictures, up to last_color_
};

}  // namespace lumigraft::capture
