#pragma once
// FrameSets of a recording from a moment on, without decoding what lies long before it. They are those of a replay from
// the beginning: pairing begins two seconds earlier, since it depends on the newest pictures.
#include <memory>

#include "capture/source.h"

namespace lumigraft {

/// `from_ns` counts from the first colour picture on; rewinding goes back to it. Throws as open_frames, and InputError
/// for live cameras.
std::unique_ptr<FrameReader> open_frames_from(const Session& session, std::int64_t from_ns);

}  // namespace lumigraft
