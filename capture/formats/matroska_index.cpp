#include "capture/formats/matroska_index.h"

#include <algorithm>
#include <array>
#include <fstream>
#include <limits>

#include "capture/formats/matroska_file.h"

namespace lumigraft::capture {
namespace {

using namespace matroska;

constexpr std::uint64_t kUnknown = std::numeric_limits<std::uint64_t>::max();
constexpr auto kLatest = static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max());

struct Element {
  std::uint64_t id = 0;
  std::uint64_t begin = 0;  ///< of the content
  std::uint64_t size = 0;
  std::uint64_t end() const { return begin + size; }
};

class ElementReader {
 public:
  explicit ElementReader(const std::filesystem::path& file) {
    in_.rdbuf()->pubsetbuf(buffer_.data(), buffer_.size());
    in_.open(file, std::ios::binary);
    std::error_code error;
    length_ = std::filesystem::file_size(file, error);
    length_ = error ? 0 : length_;
  }

  std::optional<std::int64_t> end_ns() {
    std::optional<Element> last;
    std::uint64_t scale = 1'000'000;
    const bool all = for_each_top_level([&](const Element& element, std::uint64_t) {
      if (element.id == kInfo) {
        for_each_child(element, [&](const Element& e) { scale = e.id == kTimestampScale ? number(e) : scale; });
      } else if (element.id == kCluster) {
        last = element;
      }
      return true;
    });
    const std::optional<FrameTimes> frames = all && last ? frames_of(*last) : std::nullopt;
    if (!frames || scale == 0 || frames->newest > kLatest / scale) return std::nullopt;
    return static_cast<std::int64_t>(frames->newest * scale);
  }

  std::vector<MatroskaCluster> clusters() {
    std::vector<MatroskaCluster> out;
    std::uint64_t before = 0, newest = 0;
    const bool all = for_each_top_level([&](const Element& element, std::uint64_t at) {
      if (element.id != kCluster) return true;
      const std::optional<FrameTimes> frames = frames_of(element);
      if (!frames || frames->oldest > frames->newest || frames->newest > kLatest ||
          (!out.empty() && frames->oldest <= newest)) {
        return false;
      }
      out.push_back(
          {static_cast<std::int64_t>(at), static_cast<std::int64_t>(frames->oldest), before, frames->first_is_key});
      before += frames->count;
      newest = frames->newest;
      return true;
    });
    return all ? out : std::vector<MatroskaCluster>();
  }

 private:
  /// The frames of a cluster; times in ticks.
  struct FrameTimes {
    std::uint64_t oldest = 0, newest = 0;  ///< oldest: at most the cluster's own time
    std::uint64_t count = 0;
    bool first_is_key = false;
  };

  /// Calls `action(element, position)` for the elements of the segment, up to where the file is cut or `action` returns
  /// false. Returns false if the length of an element is unknown.
  template <typename Action>
  bool for_each_top_level(const Action& action) {
    for (std::uint64_t at = 0; at < length_;) {
      const std::optional<Element> element = read(at, length_);
      if (!element) return true;
      if (element->id == kSegment) {
        at = element->begin;
        continue;
      }
      if (element->size == kUnknown) return false;
      if (!action(*element, at)) return true;
      at = element->end();
    }
    return true;
  }

  /// A variable-size integer (RFC 8794, 4) of at most `max_length` bytes; empty if there is none.
  std::optional<std::uint64_t> read_vint(int max_length, bool keep_marker) {
    const int first = in_.get();
    int length = 1;
    while (length <= max_length && (first & (0x100 >> length)) == 0) ++length;
    if (first < 0 || length > max_length) return std::nullopt;
    std::uint64_t value = static_cast<std::uint64_t>(keep_marker ? first : first & (0xFF >> length));
    for (int i = 1; i < length; ++i) {
      const int next = in_.get();
      if (next < 0) return std::nullopt;
      value = value << 8 | static_cast<std::uint64_t>(next);
    }
    const bool all_ones = value == (std::uint64_t{1} << (7 * length)) - 1;
    return all_ones && !keep_marker ? kUnknown : value;
  }

  /// The header of the element at `at`. Empty if the element does not end within `limit`, or after too many elements.
  std::optional<Element> read(std::uint64_t at, std::uint64_t limit) {
    constexpr int kMaxElements = 4'000'000;  // a day of frames; bounds the time that a hostile file takes
    if (++elements_ > kMaxElements) return std::nullopt;
    in_.clear();
    in_.seekg(static_cast<std::streamoff>(at));
    const auto id = read_vint(4, true);
    const auto size = id ? read_vint(8, false) : std::nullopt;
    if (!size) return std::nullopt;
    const Element element{*id, static_cast<std::uint64_t>(in_.tellg()), *size};
    if (element.begin > limit || (element.size != kUnknown && element.size > limit - element.begin)) {
      return element.id == kSegment ? std::optional(element) : std::nullopt;  // a Segment may be cut short
    }
    return element;
  }

  template <typename Action>
  void for_each_child(const Element& parent, const Action& action) {
    for (std::uint64_t at = parent.begin; at < parent.end();) {
      const std::optional<Element> child = read(at, parent.end());
      if (!child || child->size == kUnknown) return;
      action(*child);
      at = child->end();
    }
  }

  std::uint64_t number(const Element& element) {
    in_.clear();
    in_.seekg(static_cast<std::streamoff>(element.begin));
    std::uint64_t value = 0;
    for (std::uint64_t i = 0; i < element.size && i < 8; ++i) value = value << 8 | static_cast<std::uint8_t>(in_.get());
    return value;
  }

  struct BlockHeader {
    std::int16_t after = 0;  ///< ticks relative to the cluster
    std::uint8_t flags = 0;
  };
  /// After the track number: a signed time of two bytes and one byte of flags.
  BlockHeader header_of(const Element& block) {
    in_.clear();
    in_.seekg(static_cast<std::streamoff>(block.begin));
    read_vint(8, false);
    const auto high = static_cast<std::uint8_t>(in_.get()), low = static_cast<std::uint8_t>(in_.get());
    return {static_cast<std::int16_t>(high << 8 | low), static_cast<std::uint8_t>(in_.get())};
  }

  /// Empty if the cluster has no time.
  std::optional<FrameTimes> frames_of(const Element& cluster) {
    constexpr std::uint8_t kKeyFlag = 0x80;
    std::optional<std::uint64_t> time;
    FrameTimes out;
    std::int16_t min_after = 0, max_after = 0;
    const auto add = [&](std::int16_t after, bool key) {
      min_after = std::min(min_after, after);
      max_after = std::max(max_after, after);
      out.first_is_key = out.count == 0 ? key : out.first_is_key;
      ++out.count;
    };
    for_each_child(cluster, [&](const Element& e) {
      if (e.id == kTimestamp) {
        time = number(e);
      } else if (e.id == kSimpleBlock) {
        const BlockHeader header = header_of(e);
        add(header.after, (header.flags & kKeyFlag) != 0);
      } else if (e.id == kBlockGroup) {
        std::optional<BlockHeader> header;
        bool key = true;
        for_each_child(e, [&](const Element& inner) {
          header = inner.id == kBlock ? std::optional(header_of(inner)) : header;
          key = key && inner.id != kReferenceBlock;
        });
        if (header) add(header->after, key);
      }
    });
    if (!time) return std::nullopt;
    out.oldest = *time + static_cast<std::uint64_t>(min_after);
    out.newest = *time + static_cast<std::uint64_t>(max_after);
    return out;
  }

  std::array<char, 64> buffer_{};  ///< small, so that seeking past frames does not read them
  std::ifstream in_;
  std::uint64_t length_ = 0;
  int elements_ = 0;
};

}  // namespace

std::optional<std::int64_t> matroska_end_ns(const std::filesystem::path& file) { return ElementReader(file).end_ns(); }

std::vector<MatroskaCluster> matroska_clusters(const std::filesystem::path& file) {
  return ElementReader(file).clusters();
}

}  // namespace lumigraft::capture
