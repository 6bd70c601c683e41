#pragma once
// What the helper programs of this folder and of recorded/ have in common: they write what HelperFrames reads.
#include <functional>
#include <string>
#include <vector>

#include "capture/live/helper_messages.h"
#include "capture/session/stream_spec.h"
#include "capture/source.h"

namespace lumigraft::capture {

/// The streams of a helper's command line, from the word `first` on.
std::vector<StreamSpec> requested_streams(int count, char** words, int first);

/// main() of a helper with the words [CAMERA] STREAM...: calls `run` with the camera's name, which may be empty, and
/// the streams. What it throws is sent as `refused` (InputError) or `unavailable`. Ends the process without the camera
/// library's own actions at exit, which may wait for a camera that is gone.
using RunHelper = std::function<void(const std::string& camera, const std::vector<StreamSpec>& specs)>;
[[noreturn]] void run_helper(int count, char** words, const RunHelper& run);

/// Ends this process if the reader has gone.
void send_text(HelperMessage::Kind kind, const std::string& text);
/// `item` is of one of the requested streams.
void send_item(const SourceItem& item, const std::vector<StreamSpec>& specs);

}  // namespace lumigraft::capture
