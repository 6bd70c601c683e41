#include "capture/recorded/oni_source.h"

#include "capture/error.h"
#include "capture/live/helper_frames.h"
#include "capture/recorded/parameters.h"

namespace lumigraft::capture {

/// One pass over the recording. The constructor throws InputError with the reason alone.
class OniSource::Reader {
 public:
  Reader(const std::string& file, const std::vector<StreamSpec>& specs) try
      : frames_("lumigraft_oni", {file}, specs, kRecordedParameters.oni_timeout) {
  } catch (const CameraFault& e) {
    throw InputError(file + ": found a recording that crashes OpenNI2: " + e.what());
  }

  std::optional<SourceItem> next() {
    if (finished_) return std::nullopt;
    std::optional<SourceItem> item = frames_.next(kRecordedParameters.oni_timeout);
    if (item) {
      last_ = stamp_of(*item);
      last_stream_ = stream_of(*item);
      return item;
    }
    finished_ = true;
    const std::string why = frames_.ended() ? frames_.end_reason() : "it does not answer";
    if (why.empty()) return std::nullopt;
    fault_ = "OpenNI2 crashes while reading the rest of the recording: " + why;
    return LostFrame{{last_.time_ns, steady_now_ns(), last_.sequence + 1}, last_stream_, fault_};
  }

  bool finished() const { return finished_; }
  const std::string& fault() const { return fault_; }

 private:
  HelperFrames frames_;
  Stamp last_;
  Stream last_stream_ = Stream::color;
  bool finished_ = false;
  std::string fault_;
};

OniSource::OniSource(std::string file, std::vector<StreamSpec> specs)
    : file_(std::move(file)), specs_(std::move(specs)), reader_(std::make_unique<Reader>(file_, specs_)) {}

OniSource::~OniSource() = default;

std::optional<SourceItem> OniSource::next(std::chrono::milliseconds) {
  return reader_ == nullptr ? std::nullopt : reader_->next();
}

bool OniSource::finished() const { return reader_ == nullptr || reader_->finished(); }

void OniSource::rewind() {
  reader_.reset();
  try {
    reader_ = std::make_unique<Reader>(file_, specs_);
  } catch (const InputError&) {
    // The file does not exist any more: finished().
  }
}

std::string OniSource::fault() const { return reader_ == nullptr ? "" : reader_->fault(); }

}  // namespace lumigraft::capture
