#pragma once
// oni:FILE and openni2:[URI] - a depth camera that OpenNI2 knows, or what its recorder wrote. One object delivers
// colour and depth.
//
// A recording is stepped picture by picture, is never sought (OpenNI2 2.2 crashes) and rewinds by opening it anew; its
// times start at 0. A device runs without mirroring and with fixed exposure and white balance.
#include <chrono>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "capture/source.h"
#include "capture/stream_spec.h"

namespace lumigraft {

/// Plays a recording once to its end, whatever is in it, and may crash. `silence` is how long no picture comes at its
/// end; `heard` is called with each one.
void play_oni_file(const std::string& file, std::chrono::milliseconds silence, const std::function<void()>& heard);

/// Does so in a child process, since OpenNI2 crashes on some damaged files. Throws InputError where it
/// does. Call it before the first OpenNiSource of the process is made.
void check_oni_file(const std::string& file);

class OpenNiSource : public Source {
 public:
  enum class Kind { recording, device };

  /// `uri` is a file's path, a device's URI, or empty for any device. Throws InputError.
  OpenNiSource(Kind kind, const std::string& uri, std::vector<StreamSpec> specs);
  ~OpenNiSource() override;

  std::optional<SourceItem> next(std::chrono::milliseconds timeout) override;
  bool finished() const override;
  void rewind() override;

 private:
  class Reader;
  Kind kind_;
  std::string uri_;
  std::vector<StreamSpec> specs_;
  std::unique_ptr<Reader> reader_;
};

}  // namespace lumigraft
