#pragma once
// oni:FILE - a recording of OpenNI2. OpenNI2 crashes on some damaged files, so a helper program reads the file
// (live/helper_frames.h).
#include <memory>
#include <string>
#include <vector>

#include "capture/session/stream_spec.h"
#include "capture/source.h"

namespace lumigraft::capture {

class OniSource : public Source {
 public:
  /// Throws InputError, also if OpenNI2 crashes when it opens the file.
  OniSource(std::string file, std::vector<StreamSpec> specs);
  ~OniSource() override;

  /// If OpenNI2 crashes later, the last item is a lost frame with that reason.
  std::optional<SourceItem> next(std::chrono::milliseconds timeout) override;
  bool finished() const override;
  void rewind() override;
  std::string fault() const override;

 private:
  class Reader;
  std::string file_;
  std::vector<StreamSpec> specs_;
  std::unique_ptr<Reader> reader_;
};

}  // namespace lumigraft::capture
