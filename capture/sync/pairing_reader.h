#pragma once
// Pairs colour, depth and fish-eye frames by their timestamps.
//
// Every colour frame becomes one FrameSet. The nearest depth and fish-eye frames within half a colour period are added
// to it; each is used at most once. Frames that are late, unpaired, misordered or lost are dropped, and counted in the
// warnings of the next FrameSet.
//
// A recording is read ahead until the result is certain, so the same files always give the same FrameSets. A live
// colour frame waits for its depth for at most one colour period from its arrival, not at all where the next depth
// frame will be too late for it by the depth camera's own rate, and never for the fish-eye: a fish-eye frame that
// arrives after its FrameSet was emitted, as every bracket does, is added to the next one, up to 250 ms later, because
// light changes slowly. Live, the newest colour frame that has its depth is given, and older ones are skipped and
// counted: who reads too slowly gets no old frames.
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
  std::int64_t fisheye_offset_ns = 0;  ///< added to the fish-eye's times
};

/// The sources of a session, to be paired. Throws like open_frames.
PairedSources open_sources(const Session& session);

/// Sets serial numbers that the session does not state to those that live cameras report.
void take_serials(Session& session, const PairedSources& sources);

class PairingReader : public FrameReader {
 public:
  explicit PairingReader(PairedSources sources);

  std::optional<FrameSet> next(std::chrono::milliseconds timeout) override;
  bool finished() const override { return color_.source->finished() && good_colors().empty(); }
  void rewind() override;
  bool live() const override { return sources_.live; }
  std::vector<std::string> faults() const override;

 private:
  using Warnings = std::vector<std::string>;

  StreamLane& lane_of(Stream stream);
  bool pull(Source& source, std::chrono::milliseconds timeout);
  void pull_all_waiting();
  std::vector<const Stamp*> good_colors() const;
  std::vector<const StreamLane::Entry*> good_entries() const;
  std::int64_t bound_ns() const;
  Source* wanted() const;
  std::optional<FrameSet> next_live(std::chrono::milliseconds timeout);
  bool depth_may_come(std::int64_t time_ns) const;
  std::optional<std::size_t> newest_ready(StreamLane::Clock::time_point now) const;

  FrameSet emit(std::size_t skipped = 0);
  static std::optional<std::int64_t> nearest_ns(const StreamLane& lane, bool lost, std::int64_t time_ns,
                                                std::int64_t bound);
  static std::optional<std::int64_t> newest_ns(const StreamLane& lane, std::int64_t from_ns, std::int64_t to_ns);
  template <typename Item>
  bool take(StreamLane& lane, std::optional<std::int64_t> best_ns, std::int64_t time_ns, std::int64_t bound,
            std::vector<std::shared_ptr<const Item>>& out, Warnings& warnings);
  std::shared_ptr<const RawDepth> take_depth(std::int64_t time_ns, std::int64_t bound, Warnings& warnings);
  std::vector<std::shared_ptr<const Frame>> take_fisheye(std::int64_t time_ns, std::int64_t bound, Warnings& warnings);

  PairedSources sources_;
  StreamLane color_;
  StreamLane depth_;
  StreamLane fisheye_;
  std::optional<Stamp> last_color_;      ///< of the newest FrameSet
  std::deque<std::int64_t> periods_ns_;  ///< the newest intervals between colour frames, up to last_color_
};

}  // namespace lumigraft::capture
