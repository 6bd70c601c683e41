#pragma once
// oni:FILE - what OpenNI2's recorder wrote. OpenNI2 crashes on some damaged files, so a program of its own reads it
// (oni_messages.h), and this one gets pictures of the size it asked for or none.
#include <memory>
#include <string>
#include <vector>

#include "capture/session/stream_spec.h"
#include "capture/source.h"

namespace lumigraft::capture {

class OniSource : public Source {
 public:
  /// Throws InputError, also where OpenNI2 does not survive opening the file.
  OniSource(std::string file, std::vector<StreamSpec> specs);
  ~OniSource() override;

  /// Where OpenNI2 does not survive the rest of the recording it ends with a lost picture that says so.
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
