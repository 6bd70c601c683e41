#include "capture/sync/fisheye_reader.h"

#include <utility>

namespace lumigraft::capture {

FisheyeReader::FisheyeReader(std::shared_ptr<Source> source, std::int64_t offset_ns) : source_(std::move(source)) {
  lane_.offset_ns = offset_ns;
}

bool FisheyeReader::pull(std::chrono::milliseconds timeout) {
  std::optional<SourceItem> item = source_->next(timeout);
  if (!item) return false;
  if (std::string warning = source_->take_warning(); !warning.empty()) lane_.notes.push_back(std::move(warning));
  lane_.accept(std::move(*item));
  return true;
}

std::optional<FisheyeReader::Result> FisheyeReader::next(std::chrono::milliseconds timeout) {
  using namespace std::chrono_literals;
  constexpr std::size_t kMaxFrames = 64;  // bounds the loop if a source always has another frame
  if (!pull(timeout)) return std::nullopt;
  for (std::size_t i = 0; i < kMaxFrames && pull(0ms); ++i) {  // LiveSource delivers complete brackets
  }
  Result result;
  while (!lane_.queue.empty()) {
    SourceItem item = lane_.pop(result.warnings);
    auto* frame = std::get_if<Frame>(&item);
    if (frame == nullptr) continue;
    if (!result.frames.empty() && result.frames.front()->stamp.time_ns != frame->stamp.time_ns) result.frames.clear();
    result.frames.push_back(std::make_shared<const Frame>(std::move(*frame)));
  }
  result.warnings.insert(result.warnings.end(), lane_.notes.begin(), lane_.notes.end());
  lane_.notes.clear();
  return result;
}

std::unique_ptr<FisheyeReader> read_fisheye_apart(PairedSources& sources) {
  if (!sources.live || !sources.fisheye) return nullptr;
  return std::make_unique<FisheyeReader>(std::exchange(sources.fisheye, nullptr), sources.fisheye_offset_ns);
}

}  // namespace lumigraft::capture
