#include "capture/live/helper_source.h"

#include <unistd.h>

#include <sstream>

#include "capture/camera/camera_serial.h"
#include "capture/error.h"
#include "capture/live/parameters.h"

namespace lumigraft::capture {
namespace {

std::vector<std::string> words_of(const std::string& command) {
  std::istringstream text(command);
  std::vector<std::string> words;
  for (std::string word; text >> word;) words.push_back(word);
  const std::string program = words.empty() ? "" : words.front();
  refuse_if(!program.starts_with('/') || access(program.c_str(), X_OK) != 0,
            "found \"" + program + "\", allowed: the absolute path of a program, and its arguments");
  return words;
}

std::vector<std::string> after_first(std::vector<std::string> words) {
  words.erase(words.begin());
  return words;
}

}  // namespace

HelperSource::HelperSource(const std::string& program, std::vector<std::string> arguments,
                           const std::vector<StreamSpec>& specs)
    : frames_(program, std::move(arguments), specs, kHelperParameters.patience) {
  for (const StreamSpec& spec : specs) check_serial(frames_.serial(), spec.serial);
}

HelperSource::HelperSource(const std::string& command, const std::vector<StreamSpec>& specs)
    : HelperSource(words_of(command).front(), after_first(words_of(command)), specs) {}

std::string HelperSource::fault() const {
  if (!frames_.ended()) return {};
  return frames_.end_reason().empty() ? "its helper ended" : "its helper ended: " + frames_.end_reason();
}

}  // namespace lumigraft::capture
