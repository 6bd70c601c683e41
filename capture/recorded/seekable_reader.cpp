#include "capture/recorded/seekable_reader.h"

#include <utility>

#include "capture/error.h"
#include "capture/recorded/parameters.h"
#include "capture/recorded/seekable.h"

namespace lumigraft::capture {
namespace {

class FramesFrom : public SeekableReader {
 public:
  FramesFrom(PairedSources sources, std::unique_ptr<FrameReader> reader)
      : sources_(std::move(sources)), reader_(std::move(reader)) {
    begin();
  }

  std::optional<FrameSet> next(std::chrono::milliseconds timeout) override {
    while (std::optional<FrameSet> set = reader_->next(timeout)) {
      first_time_ns_ = first_time_ns_.value_or(set->time_ns);
      if (set->time_ns - *first_time_ns_ >= from_ns_) return set;
    }
    return std::nullopt;
  }
  bool finished() const override { return reader_->finished(); }
  void rewind() override {
    reader_->rewind();
    begin();
  }
  void seek(std::int64_t from_ns) override {
    from_ns_ = from_ns;
    rewind();
  }
  std::optional<std::int64_t> length_ns() const override {
    const auto* color = dynamic_cast<const Seekable*>(sources_.color.get());
    const std::optional<std::int64_t> last_ns = color != nullptr ? color->last_time_ns() : std::nullopt;
    return last_ns ? std::optional(*last_ns - color->first_time_ns()) : std::nullopt;
  }
  bool live() const override { return false; }
  std::vector<std::string> faults() const override { return reader_->faults(); }

 private:
  void begin() {
    auto* color = dynamic_cast<Seekable*>(sources_.color.get());
    if (color == nullptr) return;  // read from the beginning
    first_time_ns_ = color->first_time_ns();
    for (Source* source : {sources_.color.get(), sources_.depth.get(), sources_.fisheye.get()}) {
      if (auto* seekable = dynamic_cast<Seekable*>(source)) {
        seekable->skip_to(*first_time_ns_ + from_ns_ - kRecordedParameters.seek_lead_ns);
      }
    }
  }

  PairedSources sources_;
  std::unique_ptr<FrameReader> reader_;
  std::int64_t from_ns_ = 0;
  std::optional<std::int64_t> first_time_ns_;  ///< of the colour stream
};

}  // namespace

std::unique_ptr<SeekableReader> seekable_frames(PairedSources sources) {
  auto reader = std::make_unique<PairingReader>(sources);
  return std::make_unique<FramesFrom>(std::move(sources), std::move(reader));
}

std::unique_ptr<FrameReader> open_frames_from(const Session& session, std::int64_t from_ns) {
  PairedSources sources = open_sources(session);
  refuse_if(sources.live, "found live cameras, allowed: a recording");
  auto reader = seekable_frames(std::move(sources));
  reader->seek(from_ns);
  return reader;
}

}  // namespace lumigraft::capture
