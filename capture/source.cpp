#include "capture/source.h"

namespace lumigraft::capture {

const Stamp& stamp_of(const SourceItem& item) {
  return std::visit([](const auto& i) -> const Stamp& { return i.stamp; }, item);
}

Stream stream_of(const SourceItem& item) {
  if (const auto* frame = std::get_if<Frame>(&item)) return frame->stream;
  const auto* lost = std::get_if<LostFrame>(&item);
  return lost != nullptr ? lost->stream : Stream::depth;
}

const char* name_of(Stream stream) {
  return stream == Stream::color ? "colour" : stream == Stream::depth ? "depth" : "fish-eye";
}

}  // namespace lumigraft::capture
